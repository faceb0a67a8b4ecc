// Shows values under the pointer; the page is complete without it.
"use strict";
const showValues = (chart) => {
  const [left, top, width, height] = chart.dataset.plot.split(" ").map(Number);
  const scale = (text) => {
    const [spacing, low, high] = text.split(" ");
    const [a, b] = [Number(low), Number(high)];
    return spacing === "log"
      ? (part) => Math.pow(10, Math.log10(a) + part * (Math.log10(b) - Math.log10(a)))
      : (part) => a + part * (b - a);
  };
  const [toX, toY] = [scale(chart.dataset.x), scale(chart.dataset.y)];
  const lines = [...chart.querySelectorAll("polyline[data-name]")]
    .filter((line) => line.dataset.name !== "")
    .map((line) => ({
      name: line.dataset.name,
      points: line.getAttribute("points").split(" ").map((one) => one.split(",").map(Number)),
    }));
  if (lines.length === 0) return;
  const shown = (value) => Number(value.toPrecision(5)).toString();
  let readout = null;
  const hide = () => {
    if (readout) readout.remove();
    readout = null;
  };
  chart.addEventListener("pointermove", (event) => {
    const box = chart.getBoundingClientRect();
    const unit = chart.viewBox.baseVal.width / box.width;
    const at = (event.clientX - box.left) * unit - left;
    const down = (event.clientY - box.top) * unit - top;
    if (at < 0 || at > width || down < 0 || down > height) return hide();
    const nearest = lines.map(({ name, points }) => {
      const point = points.reduce((a, b) => (Math.abs(b[0] - at) < Math.abs(a[0] - at) ? b : a));
      return Math.abs(point[0] - at) < 12
        ? `${name}: ${shown(toY(1 - point[1] / height))} at ${shown(toX(point[0] / width))}`
        : null;
    });
    const texts = [...new Set(nearest.filter((text) => text !== null))];
    if (texts.length === 0) return hide();
    if (!readout) {
      readout = document.createElement("div");
      readout.className = "readout";
      readout.setAttribute("aria-hidden", "true");
      chart.parentElement.append(readout);
    }
    readout.textContent = texts.slice(0, 6).join("\n");
    const outer = chart.parentElement.getBoundingClientRect();
    const room = outer.width - readout.offsetWidth;
    readout.style.left = `${Math.max(0, Math.min(event.clientX - outer.left + 12, room))}px`;
    readout.style.top = `${event.clientY - outer.top + 16}px`;
  });
  chart.addEventListener("pointerleave", hide);
};
document.querySelectorAll("svg.chart[data-plot]").forEach(showValues);
