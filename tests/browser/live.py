"""Opens the live page of a coordinator in headless Chromium, and uses it as people do.

    live.py --osteon PROGRAM --work DIRECTORY --chromium PROGRAM

submits jobs, watches one, cancels it by the keyboard, kills the coordinator and starts it again, gives a token, shows
10,000 jobs and 1,000 workers; and looks at the page at three widths, light and dark. The rules of axe hold, no script fails, nothing but the coordinator
is asked, and the page takes less than a fifth of the browser's main thread.
"""

import concurrent.futures
import http.client
import http.server
import json
import shutil
import socket
import subprocess
import sys
import threading
import time

import crowd
import looking

JOBS = 300
# Of a coordinator that has much to show.
CROWD_JOBS, CROWD_WORKERS = 10_000, 1000
# The program's own bound of the wait for any state, s.
PATIENCE = 60
# Part of the main thread that a page may take.
MAIN_THREAD_MAX = 0.2

JOB = """[data]
mean = 3906.0
coefficient_of_variation = 0.0271
[parameters.density]
fixed = 1598.8
[parameters.longitudinal_young_modulus]
start = 19.5e9
bounds = [12e9, 25e9]
[parameters.longitudinal_poisson_ratio]
fixed = 0.3816
[parameters.longitudinal_shear_modulus]
start = 5.2e9
bounds = [3e9, 6.5e9]
[parameters.transverse_young_modulus]
fixed = 9.8254e9
[parameters.transverse_poisson_ratio]
fixed = 0.4495
[parameters.dispersion]
start = 0.12
bounds = [0.02, 0.3]
[monte_carlo]
realizations = {realizations}
seed = 7
[search]
max_evaluations = {evaluations}
"""


class Coordinator:
    """A coordinator with a live page, which can be killed and started again at the same addresses."""

    def __init__(self, osteon, directory, options=()):
        self.osteon, self.directory, self.options = osteon, directory, [*options]
        self.listen, self.http = free_address(), free_address()
        self.process = None
        self.start()

    def start(self):
        log = open(self.directory / "coordinator.log", "a")
        self.process = subprocess.Popen(
            [self.osteon, "coordinator", "--listen", self.listen, "--http", self.http, "--store",
             self.directory / "store", *self.options], stdout=subprocess.PIPE, stderr=log, text=True)
        if not self.process.stdout.readline():
            raise SystemExit(f"the coordinator does not start; see {self.directory}/coordinator.log")

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=PATIENCE)

    def run(self, *words):
        words = [self.osteon, *words, "--coordinator", f"http://{self.listen}"]
        return subprocess.run(words, check=True, capture_output=True, text=True, timeout=PATIENCE).stdout

    def submit(self, name, realizations, evaluations, *options):
        file = self.directory / f"{hash(name)}.toml"
        file.write_text(JOB.format(realizations=realizations, evaluations=evaluations))
        return json.loads(self.run("submit", file, "--json", "--name", name, *options))["job"]

    def worker(self):
        log = open(self.directory / "workers.log", "a")
        return subprocess.Popen([self.osteon, "worker", "--coordinator", f"http://{self.listen}", "--threads", "1"],
                                stdout=subprocess.DEVNULL, stderr=log)


def free_address():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{probe.getsockname()[1]}"


class Proxy(http.server.BaseHTTPRequestHandler):
    """A proxy that serves a page below a path, and passes events on as they come."""

    protocol_version = "HTTP/1.1"
    path_prefix, behind = "/lab/osteon", None

    def do_GET(self):
        if not self.path.startswith(f"{self.path_prefix}/"):
            return self.send_error(404)
        upstream = http.client.HTTPConnection(self.behind, timeout=PATIENCE)
        headers = {name: value for name, value in self.headers.items() if name.lower() != "connection"}
        upstream.request(self.command, self.path.removeprefix(self.path_prefix), headers=headers)
        answer = upstream.getresponse()
        self.send_response(answer.status)
        for name, value in answer.getheaders():
            if name.lower() not in ("connection", "transfer-encoding", "content-length", "date"):
                self.send_header(name, value)
        self.send_header("connection", "close")
        self.end_headers()
        self.close_connection = True
        try:
            while part := answer.read1(65536):
                self.wfile.write(part)
                self.wfile.flush()
        except OSError:
            # The browser has left the page.
            pass
        upstream.close()

    do_POST = do_GET

    def log_message(self, *_):
        pass


class Reader:
    """Somebody at a page, and everything that goes wrong on it."""

    def __init__(self, browser, address, width=1280, scheme="light", path="/"):
        self.context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.page, self.problems, self.may_fail = self.context.new_page(), [], False
        self.page.set_default_timeout(PATIENCE * 1000)
        self.page.on("console", self.console)
        self.page.on("pageerror", lambda error: self.problems.append(f"script: {error}"))
        self.page.on("request", lambda request: request.url.startswith(f"http://{address}{path}")
                     or self.problems.append(f"request: {request.url}"))
        self.page.goto(f"http://{address}{path}")

    def console(self, message):
        # The browser itself reports requests that are not answered, or refused.
        if not (self.may_fail and message.text.startswith("Failed to load resource")):
            self.problems.append(f"console: {message.text}")

    def is_live(self):
        self.page.locator("#status[data-state=live]").wait_for()

    def ended(self):
        self.context.close()
        return self.problems


def see(browser, coordinator, job, axe, work):
    """Looks at the page with a job open, at every width and in both colours."""
    found = []
    for width in looking.WIDTHS:
        for scheme in looking.SCHEMES:
            reader = Reader(browser, coordinator.http, width, scheme)
            reader.is_live()
            reader.page.evaluate(f"location.hash = 'job={job}'")
            reader.page.locator("#figures svg").nth(3).wait_for()
            # The pointer over a figure shows its values.
            reader.page.locator("#figures svg").first.hover()
            problems = looking.findings(reader.page, axe)
            reader.page.mouse.move(1, 1)
            reader.page.screenshot(path=work / f"live-{width}-{scheme}.png", full_page=True)
            problems += reader.ended()
            print("live page", width, scheme, "; ".join(problems) or "ok")
            found += problems
    return found


def use(browser, coordinator, axe):
    """Chooses, pages, watches, cancels and goes on after a restart; all by the keyboard where people may."""
    job = coordinator.submit("another <b>long</b> job", 1000, 300, "--priority", "9")
    reader = Reader(browser, coordinator.http)
    page = reader.page
    reader.is_live()
    page.locator("#jobs tbody tr").nth(24).wait_for()
    newest = page.locator("#jobs tbody tr").first.get_attribute("data-key")
    page.get_by_role("button", name="Older").press("Enter")
    page.locator("#page-number", has_text="Page 2").wait_for()
    page.get_by_role("button", name="Newer").press("Enter")
    page.locator(f"#jobs tbody tr[data-key='{newest}']").wait_for()
    page.get_by_role("radio", name="Running").press("Space")
    link = page.locator(f"#jobs a[href='#job={job}']")
    link.wait_for()
    link.press("Enter")
    page.locator("#h-job:focus").wait_for()
    page.locator("#h-job", has_text="<b>long</b>").wait_for()
    page.locator("#figures svg").nth(3).wait_for()
    grows(page)
    share = main_thread(reader)
    print(f"main thread: {1000 * share:.0f} ms per second")
    assert share < MAIN_THREAD_MAX, share

    reader.may_fail = True
    coordinator.kill()
    page.locator("#status[data-state=lost]").wait_for()
    assert "Reconnecting" in page.locator("#status").inner_text()
    reader.problems += looking.findings(page, axe)
    coordinator.start()
    reader.is_live()
    reader.may_fail = False
    page.locator("#figures svg").nth(3).wait_for()

    page.locator("#cancel").press("Enter")
    page.locator("#confirm[open]").wait_for()
    reader.problems += looking.findings(page, axe)
    # The first button keeps the job: who presses Enter by mistake loses nothing.
    page.keyboard.press("Enter")
    page.locator("#confirm").wait_for(state="hidden")
    page.locator("#cancel").press("Enter")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.locator("#facts", has_text="cancelled").wait_for()
    page.locator("#cancel").wait_for(state="hidden")
    page.get_by_role("button", name="Close").press("Enter")
    page.locator("#job").wait_for(state="hidden")
    return reader.ended()


def many(browser, osteon, work, axe):
    """Looks at a coordinator with thousands of jobs and workers, and turns the pages of its list."""
    directory = work / "many"
    directory.mkdir()
    coordinator = Coordinator(osteon, directory)
    people = crowd.Crowd(osteon, coordinator.listen, directory)
    try:
        people.attach(CROWD_WORKERS)
        people.submit(CROWD_JOBS)
        reader = Reader(browser, coordinator.http)
        page = reader.page
        reader.is_live()
        page.locator("#n-all", has_text=f"{CROWD_JOBS:,}").wait_for()
        page.locator("#t-workers", has_text=f"{CROWD_WORKERS:,}").wait_for()
        for number in range(2, 7):
            page.get_by_role("button", name="Older").press("Enter")
            page.locator("#page-number", has_text=f"Page {number}").wait_for()
        page.get_by_role("radio", name="Running").press("Space")
        page.locator("#jobs tbody tr .state", has_text="running").first.wait_for()
        page.get_by_role("radio", name="All").press("Space")
        page.locator("#jobs tbody tr").nth(24).wait_for()
        share = main_thread(reader)
        print(f"main thread with {CROWD_JOBS} jobs and {CROWD_WORKERS} workers: {1000 * share:.0f} ms per second")
        assert share < MAIN_THREAD_MAX, share
        reader.problems += looking.findings(page, axe)
        page.screenshot(path=work / "live-many.png", full_page=True)
        return reader.ended()
    finally:
        people.leave()
        coordinator.kill()


def through_a_proxy(browser, coordinator):
    """Opens the page below a path of a proxy, and cancels a job there."""
    job = coordinator.submit("behind a proxy", 1000, 300)
    served = http.server.ThreadingHTTPServer(("127.0.0.1", 0), type("", (Proxy,), {"behind": coordinator.http}))
    threading.Thread(target=served.serve_forever, daemon=True).start()
    try:
        reader = Reader(browser, f"127.0.0.1:{served.server_port}", path=f"{Proxy.path_prefix}/")
        reader.is_live()
        reader.page.locator(f"#jobs a[href='#job={job}']").press("Enter")
        reader.page.locator("#cancel").press("Enter")
        reader.page.get_by_role("button", name="Cancel the job").press("Enter")
        reader.page.locator("#facts", has_text="cancelled").wait_for()
        return reader.ended()
    finally:
        served.shutdown()


def grows(page):
    """Waits until the first figure is another one. Functions of Playwright that wait need what the page forbids."""
    drawn = lambda: page.locator("#figures svg").first.evaluate("svg => svg.outerHTML")
    before, deadline = drawn(), time.monotonic() + PATIENCE
    while drawn() == before:
        assert time.monotonic() < deadline, "the figures stay as they are"
        page.wait_for_timeout(100)


def main_thread(reader):
    """Returns the part of the browser's main thread that the page takes, over a few seconds."""
    session = reader.context.new_cdp_session(reader.page)
    session.send("Performance.enable")

    def taken():
        metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
        return metrics["TaskDuration"], metrics["Timestamp"]

    (busy, begun), _ = taken(), time.sleep(5)
    now_busy, now = taken()
    return (now_busy - busy) / (now - begun)


def give_token(browser, osteon, work, axe):
    """Opens the page of a coordinator with tokens, with a wrong one and with one that may only read."""
    directory = work / "tokens"
    directory.mkdir()
    token = directory / "read.token"
    subprocess.run([osteon, "token", "reader", "--role", "read", "--out", token, "--tokens", directory / "list"],
                   check=True, capture_output=True, timeout=PATIENCE)
    admin = directory / "admin.token"
    subprocess.run([osteon, "token", "admin", "--role", "admin", "--out", admin, "--tokens", directory / "list"],
                   check=True, capture_output=True, timeout=PATIENCE)
    coordinator = Coordinator(osteon, directory, ["--tokens", directory / "list"])
    try:
        job = coordinator.submit("guarded", 5, 5, "--token-file", admin)
        reader = Reader(browser, coordinator.http, 390)
        reader.may_fail = True
        page = reader.page
        page.locator("#token:focus").wait_for()
        reader.problems += looking.findings(page, axe)
        page.screenshot(path=work / "live-token.png")
        page.locator("#token").fill("osteon_" + "0" * 64)
        page.keyboard.press("Enter")
        page.locator("#login-error", has_text="does not accept the token").wait_for()
        page.locator("#token").fill(token.read_text())
        page.keyboard.press("Enter")
        reader.is_live()
        page.locator(f"#jobs a[href='#job={job}']").press("Enter")
        page.locator("#facts", has_text="admin").wait_for()
        assert page.locator("#cancel").is_hidden()
        page.reload()
        reader.is_live()
        return reader.ended()
    finally:
        coordinator.kill()


def check(arguments):
    from playwright.sync_api import sync_playwright

    work = arguments.work / "live"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    axe = looking.axe_script()
    coordinator = Coordinator(arguments.osteon, work)
    workers = []
    try:
        job = coordinator.submit("a <b>long</b> job", 400, 300, "--priority", "9")
        names = [f"bone {number}" for number in range(JOBS)]
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda name: coordinator.submit(name, 20, 6), names))
        workers += [coordinator.worker(), coordinator.worker()]
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=arguments.chromium, args=["--no-sandbox"])
            found = see(browser, coordinator, job, axe, work)
            for name, problems in (("use", use(browser, coordinator, axe)),
                                   ("many", many(browser, arguments.osteon, work, axe)),
                                   ("proxy", through_a_proxy(browser, coordinator)),
                                   ("token", give_token(browser, arguments.osteon, work, axe))):
                print("live page", name, "; ".join(problems) or "ok")
                found += problems
            browser.close()
    finally:
        for process in [*workers, coordinator.process]:
            process.kill()
            process.wait(timeout=PATIENCE)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(looking.main(check, __doc__))
