(function () {
"use strict";

// One table, four views of it.  `chosen` is the selected row, `ranges` the filters by column, and every view marks the
// selected row with the class "at" and rows that are filtered out with "out".
const data = JSON.parse(document.getElementById("data").textContent);
const rows = data.rows;
const columns = [
  ...data.inputs.map((name, k) => ({ name, isInput: true, of: (row) => row.inputs[k] })),
  ...data.figures.map((figure, k) => ({ ...figure, isInput: false, of: (row) => row.figures[k] })),
];
for (const column of columns) {
  const values = rows.map(column.of).filter((value) => value !== null);
  column.isNumber = values.length > 0 && values.every((value) => value !== "" && isFinite(value));
  if (column.isNumber && column.isInput) {
    const text = column.of;
    column.of = (row) => Number(text(row));
  }
  const known = [...new Set(rows.map(column.of).filter((value) => value !== null))];
  column.values = column.isNumber ? known.sort((a, b) => a - b) : known;
  if (column.name === "spacing" || column.name === "diameter") column.unit = data.unit;
}
const varying = columns.filter((column) => column.values.length > 1);
const PALETTE = 8;
const ranges = new Map();
let chosen = null, order = null, isRising = true;

function make(parent, name, attributes, text) {
  const isDrawn = parent.namespaceURI === "http://www.w3.org/2000/svg";
  const node = isDrawn ? document.createElementNS(parent.namespaceURI, name) : document.createElement(name);
  for (const key in attributes) node.setAttribute(key, attributes[key]);
  if (text !== undefined) node.textContent = text;
  parent.appendChild(node);
  return node;
}
const byId = (id) => document.getElementById(id);
const label = (column) => (column.unit ? `${column.name} (${column.unit})` : column.name);
function shown(value) {
  if (value === null || value === undefined) return "–";
  return typeof value === "number" ? String(Number(value.toPrecision(5))) : value;
}

// Colours: by the text column that has the most values, as long as there is a colour for each.
const colouring = varying.filter((c) => c.isInput && !c.isNumber && c.values.length <= PALETTE)
  .sort((a, b) => b.values.length - a.values.length || (b.name === "pattern") - (a.name === "pattern"))[0];
const colourOf = (row) => `var(--c${colouring ? colouring.values.indexOf(colouring.of(row)) : 0})`;
if (colouring) {
  colouring.values.forEach((value, k) => {
    const item = make(byId("legend"), "li", {});
    make(item, "span", { class: "swatch" }).style.background = `var(--c${k})`;
    item.append(value);
  });
}

// Filters.
function place(column, row) {
  const value = column.of(row);
  if (value === null) return null;
  if (!column.isNumber) return (column.values.indexOf(value) + 0.5) / column.values.length;
  const low = column.values[0], high = column.values[column.values.length - 1];
  return high > low ? (value - low) / (high - low) : 0.5;
}
function passes(row) {
  for (const [column, [low, high]] of ranges) {
    const at = place(column, row);
    if (at === null || at < low - 1e-9 || at > high + 1e-9) return false;
  }
  return true;
}

// Parallel coordinates.
const AXIS_HEIGHT = 190, TOP = 34, SIDE = 56;
const lines = new Map();
function drawParallel() {
  const svg = byId("parallel");
  svg.replaceChildren();
  lines.clear();
  const width = svg.clientWidth || 1000;
  svg.setAttribute("viewBox", `0 0 ${width} ${AXIS_HEIGHT + TOP + 24}`);
  svg.style.height = `${AXIS_HEIGHT + TOP + 24}px`;
  const step = varying.length > 1 ? (width - 2 * SIDE) / (varying.length - 1) : 0;
  const across = (k) => SIDE + k * step;
  const up = (at) => TOP + (1 - at) * AXIS_HEIGHT;
  const group = make(svg, "g", { class: "lines" });
  for (const row of rows) {
    let path = "", isBroken = true;
    varying.forEach((column, k) => {
      const at = place(column, row);
      if (at === null) { isBroken = true; return; }
      path += `${isBroken ? "M" : "L"}${across(k).toFixed(1)} ${up(at).toFixed(1)}`;
      isBroken = false;
    });
    const line = make(group, "path", { d: path });
    line.style.stroke = colourOf(row);
    lines.set(row, line);
  }
  varying.forEach((column, k) => drawAxis(svg, column, across(k), up, Math.max(step, 60), k));
}
function drawAxis(svg, column, x, up, room, k) {
  const most = Math.floor(room / 6.4);
  const name = label(column);
  const text = make(svg, "text", { class: "name", x, y: k % 2 ? 25 : 12, "text-anchor": "middle" }, name.length > 2 * most ? `${name.slice(0, 2 * most - 1)}…` : name);
  make(text, "title", {}, name);
  make(svg, "line", { class: "axis", x1: x, x2: x, y1: up(1), y2: up(0) });
  const ticks = column.isNumber ? [column.values[0], column.values[column.values.length - 1]] : column.values;
  ticks.forEach((value, i) => {
    const at = column.isNumber ? i : (i + 0.5) / ticks.length;
    const y = column.isNumber ? (i ? up(1) + 10 : up(0) + 13) : up(at) + 4;
    make(svg, "text", { x: x + 4, y }, shown(value));
  });
  const band = make(svg, "rect", { class: "range", x: x - 7, width: 14, y: 0, height: 0 });
  const grab = make(svg, "rect", { class: "grab", x: x - 14, width: 28, y: up(1) - 6, height: AXIS_HEIGHT + 12 });
  grab.dataset.column = column.name;
  const show = () => {
    const range = ranges.get(column);
    band.setAttribute("y", range ? up(range[1]) : 0);
    band.setAttribute("height", range ? up(range[0]) - up(range[1]) : 0);
    band.style.display = range ? "" : "none";
  };
  show();
  let from = null;
  const partAt = (event) => {
    const box = svg.getBoundingClientRect();
    return Math.min(Math.max(1 - (event.clientY - box.top - TOP) / AXIS_HEIGHT, 0), 1);
  };
  grab.addEventListener("pointerdown", (event) => { from = partAt(event); grab.setPointerCapture(event.pointerId); });
  grab.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const to = partAt(event);
    if (Math.abs(to - from) * AXIS_HEIGHT < 4) return;
    ranges.set(column, [Math.min(from, to), Math.max(from, to)]);
    show();
    mark();
  });
  grab.addEventListener("pointerup", (event) => {
    if (Math.abs(partAt(event) - from) * AXIS_HEIGHT < 4) ranges.delete(column);
    from = null;
    show();
    mark();
  });
}

// Scatter plot with the Pareto front of the rows that pass the filters.
const plotted = columns.filter((column) => column.isNumber && !column.isInput);
const dots = new Map();
const isBetter = (column, a, b) => (column.moreIsBetter ? a > b : a < b);
function fillChoices() {
  for (const id of ["x", "y"]) {
    plotted.forEach((column, k) => make(byId(id), "option", { value: k }, label(column)));
    byId(id).addEventListener("change", drawScatter);
  }
  const find = (name, other) => {
    const at = plotted.findIndex((column) => column.name === name);
    return at < 0 ? other : at;
  };
  byId("x").value = find("length (m)", 0);
  byId("y").value = find("least radius / allowed", 1);
}
function frontOf(x, y, inside) {
  const sorted = [...inside].sort((a, b) => (x.of(a) === x.of(b) ? (isBetter(y, y.of(a), y.of(b)) ? -1 : 1) : isBetter(x, x.of(a), x.of(b)) ? -1 : 1));
  const front = [];
  for (const row of sorted) if (!front.length || isBetter(y, y.of(row), y.of(front[front.length - 1]))) front.push(row);
  return front;
}
function drawScatter() {
  const svg = byId("scatter");
  svg.replaceChildren();
  dots.clear();
  if (!plotted.length) return;
  const x = plotted[byId("x").value], y = plotted[byId("y").value];
  const width = svg.clientWidth || 400, height = 440, left = 52, bottom = 40;
  const drawn = rows.filter((row) => passes(row) && x.of(row) !== null && y.of(row) !== null);
  const ends = (column) => {
    const values = drawn.map(column.of);
    return values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
  };
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.style.height = `${height}px`;
  const scale = (column, low, high) => {
    const [first, last] = ends(column);
    return (value) => (last > first ? low + (high - low) * (value - first) / (last - first) : (low + high) / 2);
  };
  const across = scale(x, left + 12, width - 14), up = scale(y, height - bottom - 12, 14);
  make(svg, "line", { class: "axis", x1: left, x2: width, y1: height - bottom, y2: height - bottom });
  make(svg, "line", { class: "axis", x1: left, x2: left, y1: 6, y2: height - bottom });
  ends(x).forEach((value, k) => make(svg, "text", { x: across(value), y: height - bottom + 15, "text-anchor": k ? "end" : "start" }, shown(value)));
  ends(y).forEach((value) => make(svg, "text", { x: left - 5, y: up(value) + 4, "text-anchor": "end" }, shown(value)));
  const better = (column) => (column.moreIsBetter ? "more is better" : "less is better");
  make(svg, "text", { class: "name", x: (left + width) / 2, y: height - 6, "text-anchor": "middle" }, `${label(x)}, ${better(x)}`);
  make(svg, "text", { class: "name", x: -(height - bottom) / 2, y: 13, "text-anchor": "middle", transform: "rotate(-90)" }, `${label(y)}, ${better(y)}`);
  const front = frontOf(x, y, drawn);
  make(svg, "path", { class: "front", d: front.map((row, k) => `${k ? "L" : "M"}${across(x.of(row))} ${up(y.of(row))}`).join("") });
  for (const row of drawn) {
    const dot = make(svg, "circle", { class: "dot", cx: across(x.of(row)), cy: up(y.of(row)), r: front.includes(row) ? 6.5 : 4.5 });
    dot.style.fill = colourOf(row);
    make(dot, "title", {}, nameOf(row));
    dot.addEventListener("click", () => pick(row));
    dots.set(row, dot);
  }
  svg.dataset.front = front.map((row) => row.number).sort((a, b) => a - b).join(" ");
  markViews();
}

// Names, pictures, table and the selected variant.
function nameOf(row) {
  const parts = columns.filter((c) => c.isInput && (c.values.length > 1 || c.name === "pattern"));
  return `${row.number}: ${parts.map((c) => (c.name === "spacing" ? `${shown(c.of(row))}${data.unit ? ` ${data.unit}` : ""}` : c.name === "borders" ? `borders ${c.of(row)}` : shown(c.of(row)))).join(", ")}`;
}
const thumbnails = new Map(), lineOf = new Map();
function drawPictures() {
  for (const row of rows) {
    if (!row.picture) continue;
    const item = make(byId("pictures"), "li", {});
    const button = make(item, "button", { type: "button" });
    make(button, "img", { src: row.picture, alt: "", loading: "lazy" });
    make(button, "span", {}, nameOf(row));
    button.addEventListener("click", () => pick(row));
    thumbnails.set(row, item);
  }
}
function drawTable() {
  const head = make(byId("table").tHead, "tr", {}), body = byId("table").tBodies[0];
  const headings = [{ name: "no.", isNumber: true, of: (row) => row.number }, ...columns];
  for (const column of headings) {
    const cell = make(head, "th", { scope: "col", class: column.isNumber ? "number" : "text" });
    make(cell, "button", { type: "button" }, column.unit ? label(column) : column.name).addEventListener("click", () => sortBy(column, cell));
  }
  for (const name of ["page", "error"]) make(head, "th", { scope: "col", class: "text" }, name);
  for (const row of rows) {
    const line = make(body, "tr", { tabindex: 0 });
    for (const column of headings) make(line, "td", { class: column.isNumber ? "number" : "text" }, shown(column.of(row)));
    const link = make(line, "td", { class: "text" });
    if (row.page) make(link, "a", { href: row.page, target: "_blank", rel: "noopener" }, "open");
    make(line, "td", { class: "error" }, row.error);
    line.addEventListener("click", () => pick(row));
    line.addEventListener("keydown", (event) => { if (event.key === "Enter") pick(row); });
    lineOf.set(row, line);
  }
}
function sortBy(column, cell) {
  isRising = order === column ? !isRising : true;
  order = column;
  for (const other of byId("table").tHead.querySelectorAll("th")) other.removeAttribute("aria-sort");
  cell.setAttribute("aria-sort", isRising ? "ascending" : "descending");
  const sign = isRising ? 1 : -1;
  const compare = (a, b) => {
    const one = column.of(a), two = column.of(b);
    if (one === null || two === null) return (one === null) - (two === null);
    return sign * (one < two ? -1 : one > two ? 1 : 0) || a.number - b.number;
  };
  byId("table").tBodies[0].append(...[...rows].sort(compare).map((row) => lineOf.get(row)));
}
function pick(row) {
  chosen = row;
  const card = byId("picked");
  card.replaceChildren();
  make(card, "h3", {}, nameOf(row));
  if (row.number === data.best) make(card, "p", {}, "The choice of weavecore choose: most rods bend, then fewest ends.");
  if (row.picture) make(card, "img", { src: row.picture, alt: `Picture of variant ${row.number}` });
  if (row.page) make(card, "a", { href: row.page, target: "_blank", rel: "noopener" }, "Open in three dimensions");
  if (row.error) make(card, "p", { class: "error" }, row.error);
  const list = make(card, "dl", {});
  for (const column of columns) {
    const pair = make(list, "div", {});
    make(pair, "dt", {}, label(column));
    make(pair, "dd", {}, shown(column.of(row)));
  }
  markViews();
}
function markViews() {
  for (const row of rows) {
    const isOut = !passes(row), isAt = row === chosen;
    for (const node of [lines.get(row), dots.get(row)]) {
      if (!node) continue;
      node.classList.toggle("out", isOut);
      node.classList.toggle("at", isAt);
    }
    const picture = thumbnails.get(row);
    if (picture) {
      picture.hidden = isOut;
      picture.firstChild.classList.toggle("at", isAt);
    }
    lineOf.get(row).hidden = isOut;
    lineOf.get(row).classList.toggle("at", isAt);
  }
  if (chosen && lines.get(chosen)) lines.get(chosen).parentNode.append(lines.get(chosen));
}
function mark() {
  const count = rows.filter(passes).length;
  const failed = rows.filter((row) => row.error).length;
  let text = ranges.size ? `${count} of ${rows.length} variants` : `${rows.length} variants`;
  if (rows.length < data.count) text += `, the best of ${data.count}`;
  if (failed) text += `, ${failed} with errors`;
  byId("count").textContent = text;
  byId("reset").disabled = !ranges.size;
  drawScatter();
}

byId("reset").addEventListener("click", () => { ranges.clear(); drawParallel(); mark(); });
fillChoices();
drawPictures();
drawTable();
drawParallel();
mark();
const first = rows.find((row) => row.number === data.best) || rows[0];
if (first) pick(first);
let resizing = 0;
window.addEventListener("resize", () => {
  cancelAnimationFrame(resizing);
  resizing = requestAnimationFrame(() => { drawParallel(); drawScatter(); });
});
document.documentElement.dataset.ready = "true";
})();
