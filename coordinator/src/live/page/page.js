// The live page: asks the coordinator for a stream of updates, and shows them.
"use strict";

const byId = (id) => document.getElementById(id);
const TOKEN = "osteon-token";
// Without a sign of life for this long, the stream is taken for broken (ms); the coordinator sends one
// every three seconds.
const SILENCE = 12000;
const [RETRY_FIRST, RETRY_LAST] = [500, 5000];

const shown = { show: "all", pages: [], job: null, group: null };
let token = sessionStorage.getItem(TOKEN) ?? "";
let [attempt, stream] = [0, null];
let [jobs, detail, moreAfter, mayCancel] = [[], null, null, false];

// ---- Words and numbers

const whole = (number) => Math.round(number).toLocaleString("en");
const rate = (number) => (number >= 100 ? whole(number) : String(Number(number.toPrecision(3))));
const digits = (number) => (number === null ? "–" : String(Number(number.toPrecision(5))));
const words = (name) => name.replaceAll("_", " ");
const count = (number, one, several) => `${whole(number)} ${number === 1 ? one : several}`;
const span = (seconds) => {
  const all = Math.floor(seconds);
  const [d, h, min, s] = [Math.floor(all / 86400), Math.floor(all / 3600) % 24, Math.floor(all / 60) % 60, all % 60];
  if (d > 0) return `${d} d ${h} h`;
  if (h > 0) return `${h} h ${min} min`;
  return min > 0 ? `${min} min ${s} s` : `${s} s`;
};
const milliseconds = (seconds) => (seconds === null ? "–" : `${Number((1000 * seconds).toPrecision(2))} ms`);
const title = (job) => (job.name === "" ? `Job ${job.job}` : job.name);
const date = (seconds) => (seconds === null ? "–" : new Date(1000 * seconds).toLocaleString());

// State and ending of a job, in words, with a class for its colour.
const standing = (job) => {
  if (job.state !== "ended") return [job.state, ""];
  if (job.status === "converged") return [job.kind === "propagation" ? "done" : "converged", "good"];
  return [words(job.status ?? "ended"), job.status === "failed" ? "bad" : "caution"];
};

// ---- Elements: nothing is written that is the same already

const put = (node, text) => {
  if (node.textContent !== text) node.textContent = text;
};
const attribute = (node, name, value) => {
  if (node.getAttribute(name) !== value) node.setAttribute(name, value);
};
const element = (name, className, text) => {
  const made = document.createElement(name);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
};
// Makes the children of `parent` those of `items`, by their keys, and fills them; focus stays.
const reconcile = (parent, items, keyOf, make, fill) => {
  const known = new Map([...parent.children].map((child) => [child.dataset.key, child]));
  items.forEach((item, place) => {
    const key = String(keyOf(item));
    const child = known.get(key) ?? make(item);
    known.delete(key);
    child.dataset.key = key;
    if (parent.children[place] !== child) parent.insertBefore(child, parent.children[place] ?? null);
    fill(child, item);
  });
  known.forEach((child) => child.remove());
};
const facts = (list, pairs) =>
  reconcile(list, pairs, ([name]) => name, ([name]) => {
    const pair = element("div");
    pair.append(element("dt", "", name), element("dd"));
    return pair;
  }, (pair, [, value]) => put(pair.lastChild, value));
const rows = (table, items, keyOf, cellsOf) =>
  reconcile(byId(table).tBodies[0], items, keyOf, (item) => {
    const row = element("tr");
    cellsOf(item).forEach((_, place) => {
      const cell = element(place === 0 ? "th" : "td");
      if (place === 0) cell.scope = "row";
      row.append(cell);
    });
    return row;
  }, (row, item) => cellsOf(item).forEach((text, place) => put(row.cells[place], text)));

const say = (state, text) => {
  byId("status").dataset.state = state;
  put(byId("status"), text);
};

// ---- What the events say

const showOverview = (overview) => {
  const { jobs: all, workers, realizations, store, core } = overview;
  const total = workers.slots_busy + workers.slots_idle + workers.slots_unavailable;
  put(byId("t-running"), whole(all.running));
  put(byId("t-waiting"), whole(all.waiting));
  put(byId("t-workers"), whole(workers.count));
  put(byId("t-threads"), `${whole(workers.slots_busy)} of ${whole(total)}`);
  put(byId("t-rate"), rate(workers.realizations_per_second));
  put(byId("t-store"), store.refusing_s > 0 ? "refuses" : "in order");
  put(byId("n-all"), whole(all.running + all.waiting + all.ended));
  for (const state of ["running", "waiting", "ended"]) put(byId(`n-${state}`), whole(all[state]));
  put(byId("version"), `osteon ${overview.version}`);
  document.title = `${all.running} running, ${all.waiting} waiting – osteon`;
  showAlerts(overview);
  showWorkers(workers);
  showFailures(realizations);
  facts(byId("health"), [
    ["Writes to the store", `${whole(store.writes)}, mean ${milliseconds(store.mean_write_s)}`],
    ["Records waiting for the store", whole(store.queue)],
    ["Errors of the store", whole(store.errors)],
    ["Requests waiting for the coordinator", whole(core.queue)],
    ["Mean time of an event", milliseconds(core.mean_event_s)],
    ["Batches with workers", whole(core.batches)],
    ["Oldest batch", core.batches > 0 ? span(core.oldest_batch_s) : "–"],
    ["Answers that differ between workers", whole(overview.mismatches)],
  ]);
};

const showAlerts = ({ jobs: all, workers, mismatches, concerns }) => {
  const alerts = [];
  for (const [number, text] of concerns.entries()) alerts.push(["bad", `Note ${number + 1}`, `${text[0].toUpperCase()}${text.slice(1)}.`]);
  if (workers.count === 0 && all.running + all.waiting > 0) alerts.push(["caution", "Workers", "None is attached, so nothing is computed."]);
  if (workers.banned > 0) alerts.push(["bad", "Banned", `${count(workers.banned, "host", "hosts")} gave wrong results and ${workers.banned === 1 ? "is" : "are"} refused until an operator lifts the ban (osteon worker unban).`]);
  if (workers.on_probation + workers.distrusted > 0) alerts.push(["caution", "Unreliable", `${count(workers.on_probation + workers.distrusted, "worker gets", "workers get")} little work: batches were lost or not answered.`]);
  if (mismatches > 0 && workers.banned === 0) alerts.push(["caution", "Answers", `${count(mismatches, "answer differs", "answers differ")} from that of another worker.`]);
  byId("alerts").hidden = alerts.length === 0;
  reconcile(byId("alerts"), alerts, ([, name]) => name, ([, name]) => {
    const item = element("li");
    item.append(element("span", "mark", name), element("span"));
    return item;
  }, (item, [kind, , text]) => {
    attribute(item, "class", kind);
    put(item.lastChild, text);
  });
};

const showWorkers = (workers) => {
  const parts = [`${count(workers.count, "worker is", "workers are")} attached`];
  for (const [key, text] of [["draining", "draining"], ["on_probation", "on probation"], ["distrusted", "distrusted"], ["banned", "banned"]]) {
    if (workers[key] > 0) parts.push(`${whole(workers[key])} ${text}`);
  }
  if (workers.lost > 0) parts.push(`${whole(workers.lost)} lost since the start`);
  put(byId("workers-note"), `${parts.join(", ")}. The jobs could use ${count(workers.slots_wanted, "thread", "threads")}.`);
  byId("hosts-table").hidden = workers.hosts.length === 0;
  rows("hosts", workers.hosts, (host) => host.host, (host) => [
    host.host,
    host.not_ok > 0 ? `${whole(host.workers)} (${whole(host.not_ok)} not in order)` : whole(host.workers),
    whole(host.threads),
    rate(host.realizations_per_second),
    whole(host.batches),
    `${span(host.silent_s)} ago`,
  ]);
  byId("more-hosts").hidden = workers.more_hosts === 0;
  put(byId("more-hosts"), `and ${count(workers.more_hosts, "host", "hosts")} with fewer workers`);
  byId("departed").hidden = workers.departed.length === 0;
  reconcile(byId("departed").querySelector("ul"), workers.departed, (gone) => `${gone.host}/${gone.process}/${gone.depart_time}`,
    () => element("li"), (item, gone) => put(item, `${gone.host}, process ${gone.process}, ${date(gone.depart_time)}: ${gone.reason}`));
};

const showFailures = ({ succeeded, failed }) => {
  const kinds = Object.entries(failed).filter(([, number]) => number > 0);
  const bad = kinds.reduce((sum, [, number]) => sum + number, 0);
  const all = succeeded + bad;
  put(byId("failures-note"), `${count(all, "realization has", "realizations have")} been computed, ${bad === 0 ? "none failed." : `${whole(bad)} of them failed.`}`);
  byId("failures-table").hidden = kinds.length === 0;
  rows("failures", kinds, ([kind]) => kind, ([kind, number]) => [words(kind), whole(number), `${Number(((100 * number) / all).toPrecision(2))} %`]);
};

const showJobs = (page) => {
  jobs = page.jobs;
  moreAfter = page.more_after;
  byId("no-jobs").hidden = jobs.length > 0;
  byId("jobs").parentElement.hidden = jobs.length === 0;
  byId("newer").disabled = shown.pages.length === 0;
  byId("older").disabled = moreAfter === null;
  byId("pages").hidden = shown.pages.length === 0 && moreAfter === null;
  put(byId("page-number"), `Page ${whole(shown.pages.length + 1)}`);
  reconcile(byId("jobs").tBodies[0], jobs, (job) => job.job, jobRow, fillJobRow);
};

const jobRow = (job) => {
  const row = element("tr");
  const name = element("th");
  name.scope = "row";
  const link = element("a");
  link.href = `#job=${job.job}`;
  name.append(link, element("span", "note"));
  const state = element("td");
  state.append(element("span", "state"), element("span", "note"));
  const progress = element("td");
  const line = element("span", "progress");
  const bar = element("progress");
  line.append(bar, " ", element("span"));
  progress.append(line, element("span", "note"));
  row.append(name, state, progress, element("td"), element("td", "wide"), element("td", "wide"));
  return row;
};

const fillJobRow = (row, job) => {
  const [name, state, progress, time, client, priority] = row.cells;
  attribute(row, "data-state", job.state);
  attribute(row, "aria-current", job.job === shown.job ? "true" : "false");
  put(name.firstChild, title(job));
  put(name.lastChild, job.name === "" ? "" : `job ${job.job}`);
  const [text, kind] = standing(job);
  put(state.firstChild, text);
  attribute(state.firstChild, "class", `state ${kind}`);
  put(state.lastChild, job.waiting_for === "" ? job.integrity : `waits for ${job.waiting_for}`);
  const single = job.kind === "propagation";
  const [done, all] = single ? [job.realizations_done, job.realizations] : [job.evaluations, job.max_evaluations];
  const bar = progress.firstChild.firstChild;
  // Attributes, because a bar without one of them is shown as that of a work without a known end.
  attribute(bar, "max", String(all));
  attribute(bar, "value", String(done));
  attribute(bar, "aria-label", `${single ? "realizations" : "evaluations"} of ${title(job)}`);
  put(progress.firstChild.lastChild, `${whole(done)} of ${whole(all)}`);
  const under = job.state === "running" ? `, now ${whole(job.realizations_done)} of ${whole(job.realizations)} realizations` : "";
  put(progress.lastChild, single ? "realizations" : `evaluations at most${under}`);
  put(time, span(job.elapsed_s));
  put(client, job.client);
  put(priority, String(job.priority));
};

const showJob = (job) => {
  if (job.job !== shown.job) return;
  byId("job").hidden = false;
  if (job.error !== undefined) {
    put(byId("h-job"), `Job ${job.job}`);
    put(byId("job-note"), job.error);
    byId("job-facts").hidden = true;
    byId("cancel").hidden = true;
    return;
  }
  const [text] = standing(job);
  if (detail !== null && detail.job === job.job && detail.state !== "ended" && job.state === "ended") {
    put(byId("job-note"), `${title(job)} has ended: ${text}.`);
  }
  detail = job;
  byId("job-facts").hidden = false;
  put(byId("h-job"), job.name === "" ? `Job ${job.job}` : `Job ${job.job}: ${job.name}`);
  byId("cancel").hidden = !mayCancel || job.state === "ended";
  put(byId("job-explain"), job.explain.text);
  const pairs = [
    ["State", text],
    ["Submitter", job.client === "" ? "–" : job.client],
    ["Priority", String(job.priority)],
    ["Submitted", date(job.submit_time)],
    ["Time", span(job.elapsed_s)],
    ["Evaluations", `${whole(job.evaluations)} of at most ${whole(job.max_evaluations)}`],
  ];
  if (job.state !== "ended") {
    pairs.push(["Realizations of this evaluation", `${whole(job.realizations_done)} of ${whole(job.realizations)}`]);
    pairs.push(["Threads that compute for it", `${rate(job.explain.slots_used)} of ${whole(job.explain.slots)}`]);
    pairs.push(["Realizations per second", rate(job.realizations_per_second)]);
  } else {
    pairs.push(["Realizations of each evaluation", whole(job.realizations)]);
  }
  if (job.best_cost !== null) pairs.push(["Lowest cost", digits(job.best_cost)]);
  if (job.best_mean !== null) pairs.push(["Mean velocity at the best point", `${digits(job.best_mean)} m/s`]);
  if (job.best_coefficient_of_variation !== null) pairs.push(["Coefficient of variation there", digits(job.best_coefficient_of_variation)]);
  facts(byId("facts"), pairs);
};

const showFigures = (found) => {
  if (found === null || found.job !== shown.job) return;
  const search = detail === null || detail.kind !== "propagation";
  byId("no-figures").hidden = found.figures.length > 0 || !search;
  byId("group-choice").hidden = found.groups.length < 2;
  const options = [...found.groups.keys()].map(String);
  reconcile(byId("group"), options, (set) => set, () => element("option"), (option, set) => {
    option.value = set;
    put(option, found.groups[Number(set)]);
  });
  if (found.group !== null && byId("group") !== document.activeElement) byId("group").value = String(found.group);
  reconcile(byId("figures"), found.figures, (figure) => figure.name, (figure) => {
    const made = element("figure");
    made.append(element("h3", "", figure.title), element("div"), element("figcaption"));
    return made;
  }, (made, figure) => {
    const holder = made.children[1];
    put(made.children[0], figure.title);
    put(made.children[2], figure.reading);
    if (holder.figureText === figure.svg) return;
    holder.figureText = figure.svg;
    const drawn = new DOMParser().parseFromString(figure.svg, "image/svg+xml").documentElement;
    holder.replaceChildren(document.importNode(drawn, true));
    showValues(holder.firstChild);
  });
};

const HANDLERS = {
  caller: (caller) => {
    mayCancel = caller.may_cancel;
  },
  overview: showOverview,
  jobs: showJobs,
  job: showJob,
  figures: showFigures,
};

// ---- The stream

const headers = () => (token === "" ? {} : { authorization: `Bearer ${token}` });
const pause = (time) => new Promise((done) => setTimeout(done, time));
const query = () => {
  const wanted = new URLSearchParams({ show: shown.show });
  if (shown.pages.length > 0) wanted.set("before", shown.pages.at(-1));
  if (shown.job !== null) wanted.set("job", shown.job);
  if (shown.job !== null && shown.group !== null) wanted.set("group", shown.group);
  return wanted;
};
const errorOf = async (response) => {
  try {
    return (await response.json()).error;
  } catch {
    return `the coordinator answers ${response.status}`;
  }
};
const handle = (event) => {
  const [name, data] = ["event: ", "data: "].map((key) =>
    event.split("\n").find((line) => line.startsWith(key))?.slice(key.length));
  if (name in HANDLERS && data !== undefined) HANDLERS[name](JSON.parse(data));
};

// Reads events until the stream ends, or is silent for too long.
const read = async (body, mine, abort) => {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let [text, watchdog] = ["", 0];
  try {
    for (;;) {
      watchdog = setTimeout(abort, SILENCE);
      const { value, done } = await reader.read();
      clearTimeout(watchdog);
      if (done || mine !== attempt) return;
      const events = (text + value).split("\n\n");
      text = events.pop();
      events.forEach(handle);
      byId("content").hidden = false;
      say("live", "Live");
    }
  } finally {
    clearTimeout(watchdog);
  }
};

// Keeps the page up to date, whatever becomes of the connection, until another attempt replaces this one.
const follow = async () => {
  attempt += 1;
  const mine = attempt;
  stream?.abort();
  let delay = RETRY_FIRST;
  while (mine === attempt) {
    let reason = "the coordinator does not answer";
    const control = new AbortController();
    stream = control;
    try {
      const response = await fetch(`events?${query()}`, { headers: headers(), signal: control.signal, cache: "no-store" });
      if (mine !== attempt) return;
      if (response.status === 401 || response.status === 403) return askForToken(await errorOf(response));
      if (response.ok) {
        delay = RETRY_FIRST;
        await read(response.body, mine, () => control.abort());
      } else {
        reason = await errorOf(response);
      }
    } catch {
      // The connection is broken, or was given up.
    }
    if (mine !== attempt) return;
    say("lost", `Reconnecting: ${reason}`);
    await pause(delay);
    delay = Math.min(2 * delay, RETRY_LAST);
  }
};

const askForToken = (message) => {
  say("lost", "Not connected");
  byId("content").hidden = true;
  byId("login").hidden = false;
  put(byId("login-error"), token === "" ? "" : message);
  token = "";
  sessionStorage.removeItem(TOKEN);
  byId("token").focus();
};

// ---- What people do

byId("login").addEventListener("submit", (event) => {
  event.preventDefault();
  token = byId("token").value.trim();
  sessionStorage.setItem(TOKEN, token);
  byId("token").value = "";
  byId("login").hidden = true;
  say("connecting", "Connecting");
  follow();
});

byId("show").addEventListener("change", (event) => {
  [shown.show, shown.pages] = [event.target.value, []];
  follow();
});
byId("older").addEventListener("click", () => {
  if (moreAfter === null) return;
  shown.pages.push(moreAfter);
  byId("older").disabled = true;
  follow();
});
byId("newer").addEventListener("click", () => {
  shown.pages.pop();
  follow();
});
byId("group").addEventListener("change", (event) => {
  shown.group = event.target.value;
  follow();
});
byId("close").addEventListener("click", () => {
  const row = byId("jobs").querySelector('tr[aria-current="true"] a');
  location.hash = "";
  (row ?? byId("h-jobs")).focus();
});

const choose = (focus) => {
  const job = /^#job=([0-9]+)$/.exec(location.hash)?.[1] ?? null;
  if (job === shown.job) return;
  [shown.job, shown.group, detail] = [job, null, null];
  byId("job").hidden = job === null;
  byId("job-facts").hidden = true;
  byId("cancel").hidden = true;
  byId("no-figures").hidden = true;
  byId("figures").replaceChildren();
  put(byId("h-job"), `Job ${job ?? ""}`);
  put(byId("job-note"), "");
  jobs.forEach((one, place) => {
    const row = byId("jobs").tBodies[0].rows[place];
    if (row) fillJobRow(row, one);
  });
  if (focus && job !== null) {
    byId("h-job").focus();
    byId("h-job").scrollIntoView();
  }
};
addEventListener("hashchange", () => {
  choose(true);
  follow();
});

byId("cancel").addEventListener("click", () => {
  if (detail === null) return;
  const dialog = byId("confirm");
  dialog.dataset.job = detail.job;
  put(byId("confirm-question"), `Cancel ${title(detail)}?`);
  dialog.returnValue = "";
  dialog.showModal();
});
byId("confirm").addEventListener("close", async () => {
  const { returnValue, dataset: { job } } = byId("confirm");
  if (returnValue !== "yes") return;
  put(byId("job-note"), "Cancelling");
  let text = "Cancelled.";
  try {
    const response = await fetch(`data/jobs/${job}/cancel`, { method: "POST", headers: headers() });
    if (!response.ok) text = `Not cancelled: ${await errorOf(response)}`;
  } catch {
    text = "Not cancelled: the coordinator does not answer; try again when the page is live";
  }
  if (job === shown.job) put(byId("job-note"), text);
});

choose(false);
follow();
