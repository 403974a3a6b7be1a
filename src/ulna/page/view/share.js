// The state of the page in its address, and a run to take away.

/** Fields of the address: [key, value] pairs of what differs from how the page was made. */
function toAddress(app) {
  const pairs = [];
  for (const row of app.inputRows) if (!app.replay && app.input(row.name) !== row.value) pairs.push([`in.${row.name}`, app.input(row.name)]);
  app.settings.forEach((settings, k) => {
    for (const key of Object.keys(settings.parameters)) pairs.push([`p.${k}.${key}`, settings.parameters[key]]);
    for (const key of Object.keys(settings.options)) pairs.push([`o.${k}.${key}`, Number(settings.options[key])]);
  });
  for (const key of Object.keys(app.initial)) pairs.push([`x.${key}`, app.initial[key]]);
  if (app.clock.speed !== app.pace) pairs.push(["speed", app.clock.speed]);
  if (app.curves.window !== 10) pairs.push(["window", app.curves.window]);
  if (app.plane && (app.plane.x !== app.payload.plane.x || app.plane.y !== app.payload.plane.y)) pairs.push(["plane", `${app.plane.x},${app.plane.y}`]);
  const usual = app.usualCurves.join();
  if (app.curves.names && app.curves.names.join() !== usual) pairs.push(["curves", app.curves.names.join()]);
  return pairs.map(([key, value]) => `${encodeURIComponent(key)}=${encodeURIComponent(value)}`).join("&");
}

/** What an address says, as far as it fits this page: numbers that are finite and names that exist. */
function fromAddress(app, text) {
  for (const part of text.replace(/^#/, "").split("&")) {
    const cut = part.indexOf("=");
    if (cut < 0) continue;
    let [key, value] = ["", ""];
    try {
      [key, value] = [decodeURIComponent(part.slice(0, cut)), decodeURIComponent(part.slice(cut + 1))];
    } catch {
      continue;
    }
    const number = Number(value);
    const [kind, ...rest] = key.split(".");
    const fits = value !== "" && Number.isFinite(number);
    if (kind === "in" && fits) app.setInput(rest.join("."), number);
    else if (kind === "x" && fits && app.loops[0].facts.states.some((s) => s.name === rest.join("."))) app.initial[rest.join(".")] = number;
    else if (kind === "p" && fits) app.setParameter(Number(rest[0]), rest[1], rest.slice(2).join("."), number);
    else if (kind === "o" && fits) app.setOption(Number(rest[0]), rest.slice(1).join("."), number);
    else if (key === "speed" && fits && number >= 0.0001 && number <= 2 * app.pace) app.clock.speed = number;
    else if (key === "window" && [5, 10, 20, 60].includes(number)) app.curves.window = number;
    else if (key === "plane" && app.plane) {
      const names = value.split(",");
      if (names.length === 2 && names.every((name) => app.loops[0].facts.states.some((s) => s.name === name))) app.plane.axes(...names);
    } else if (key === "curves") {
      const names = value.split(",").filter((name) => app.signal(name));
      if (names.length) app.curves.show(names);
    }
  }
}

/** The run as a table: time, then every quantity of every loop, in SI. */
function toCsv(app) {
  const { record, loops, payload } = app;
  const plain = (text) => (/^[=+\-@\t]/.test(text) ? `'${text}` : text); // a spreadsheet must not run a name
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const several = loops.length > 1;
  const columns = loops.flatMap((_, k) => record.signals[k].map((signal) => ({
    head: (several ? `${payload.loops[k].title}: ` : "") + signal.name, row: record.columns[k][signal.name],
  })));
  const lines = [["time", ...columns.map((column) => quoted(plain(column.head)))].join(",")];
  for (let j = 0; j < record.length; j += 1) {
    lines.push([record.times[j], ...columns.map((column) => (Number.isFinite(column.row[j]) ? column.row[j] : ""))].join(","));
  }
  return `${lines.join("\r\n")}\r\n`;
}

/** Picture, curves and phase plane as they stand, in one image. */
function toImage(app) {
  const ratio = 2;
  const canvases = [app.stage.sheet.canvas, ...document.querySelectorAll("#curves canvas")];
  if (app.plane) canvases.push(app.plane.sheet.canvas);
  const rows = canvases.map((canvas) => ({ canvas, w: canvas.getBoundingClientRect().width, h: canvas.getBoundingClientRect().height }));
  const width = Math.max(...rows.map((row) => row.w)) + 40;
  const heads = app.curves.panels.map((panel) => labelOf(panel.signal));
  const titles = ["", ...heads, ""];
  const height = 56 + rows.reduce((sum, row) => sum + row.h + 26, 0) + 12;
  const sheet = el("canvas");
  [sheet.width, sheet.height] = [Math.ceil(width * ratio), Math.ceil(height * ratio)];
  const c = sheet.getContext("2d");
  c.scale(ratio, ratio);
  c.fillStyle = app.look.back;
  c.fillRect(0, 0, width, height);
  label(c, app.payload.title, [20, 22], app.look.ink, { size: 16, weight: "600" });
  label(c, `at ${steady(app.clockTime)} s${app.payload.hash ? `, design ${app.payload.hash}` : ""}`, [20, 42], app.look.muted);
  let y = 60;
  rows.forEach((row, k) => {
    if (titles[k]) label(c, titles[k], [20, y + 8], app.look.ink, { weight: "600" });
    y += 18;
    c.drawImage(row.canvas, 20, y, row.w, row.h);
    y += row.h + 8;
  });
  return sheet;
}

function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = el("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 2000);
}

/** A name for a file from a title. */
const fileName = (title, ending) => `${title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60) || "run"}.${ending}`;
