// Scrolling curves: one panel a quantity, one colour a controller, the same colour everywhere.

class Curves {
  constructor(place, app) {
    this.place = place;
    this.app = app;
    this.window = 10;
    this.panels = [];
  }

  /** Show these quantities, by name. */
  show(names) {
    for (const panel of this.panels) panel.plot.destroy();
    this.place.replaceChildren();
    this.margin = 54;
    this.names = names.filter((name) => this.app.signal(name));
    this.panels = this.names.map((name, k) => this._panel(name, k === names.length - 1));
    this.draw();
    this.tell();
  }

  /** s of the loop's time that are shown: the window is of the time in which people see it. */
  get span() {
    return this.window * this.app.pace;
  }

  resize() {
    for (const panel of this.panels) panel.plot.setSize(this._size(panel.last));
    this.draw();
  }

  /** Which rows belong to a panel: the quantity of each loop, its estimate, its set point. */
  _lines(name) {
    const { app } = this;
    const lines = [];
    const partners = [[name, "line"], [`${name}_hat`, "estimate"], [`${name}_ref`, "reference"]];
    for (const output in app.payload.shows) {
      if (app.payload.shows[output] === name) partners.push([`${output}_ref`, "reference"]);
    }
    app.loops.forEach((_, k) => {
      for (const [label, role] of partners) {
        const column = app.record.columns[k][label];
        if (!column || (role === "reference" && lines.some((line) => line.role === role))) continue;
        lines.push({ k, column, role, scale: app.signal(label, k).scale || 1 });
      }
    });
    return lines.sort((one, other) => (one.role === "reference" ? -1 : 0) - (other.role === "reference" ? -1 : 0));
  }

  _size(last) {
    return { width: Math.max(200, this.place.clientWidth), height: last ? 148 : 122 };
  }

  _panel(name, last) {
    const { app } = this;
    const signal = app.signal(name);
    const lines = this._lines(name);
    const look = () => app.look;
    const series = lines.map((line) => ({
      stroke: () => (line.role === "reference" ? look().muted : look().colour(line.k)),
      width: line.role === "line" ? 2 : 1.5,
      dash: line.role === "reference" ? [2, 3] : line.role === "estimate" ? [6, 4] : dashOf(line.k),
      points: { show: false },
    }));
    const axis = (extra) => ({
      stroke: () => look().muted,
      grid: { stroke: () => look().rule, width: 1 },
      ticks: { show: false },
      font: "12px system-ui, sans-serif",
      ...extra,
    });
    const head = el("h3", {}, signal.text || signal.name);
    if (unitText(signal) || signal.text) {
      head.append(el("span", { class: "unit" }, signal.text ? ` ${labelOf(signal)}` : ` (${unitText(signal)})`));
    }
    const live = el("p", { class: "live" });
    const values = app.loops.map((_, k) => el("span", { class: `swatch s${k % 7}` }, ""));
    live.append(...values);
    const holder = el("div", { class: "plot", role: "img", "aria-label": `Curve of ${signal.text || signal.name} over time` });
    this.place.append(el("section", { class: "panel" }, el("header", { class: app.loops.length > 2 ? "stacked" : "" }, head, live), holder));
    const plot = new uPlot(
      {
        ...this._size(last),
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, sync: { key: "time" }, points: { show: false }, y: false },
        padding: [6, 8, 0, 0],
        scales: {
          x: { time: false, range: () => [this.start, this.start + this.span] },
          y: { range: (_, low, high) => spread(low, high) },
        },
        series: [{}, ...series],
        axes: [
          axis({ size: last ? 34 : 6, values: last ? (_, ticks) => ticks.map((t) => words(t, 6)) : () => [], label: last ? "time (s)" : null,
            labelSize: 16, labelFont: "12px system-ui, sans-serif", labelGap: 0, gap: 3 }),
          axis({ size: (_, texts) => this._margin(texts), gap: 4, space: 28, values: (_, ticks) => ticks.map((t) => words(t)) }),
        ],
        hooks: { drawAxes: [(u) => this._limits(u, name)] },
      },
      [[], ...lines.map(() => [])],
      holder,
    );
    return { name, signal, lines, plot, values, last };
  }

  /** Room for the numbers at the side, the same for all panels, so that their times stand below each other. */
  _margin(texts) {
    for (const each of texts || []) this.margin = Math.max(this.margin, 14 + 7 * each.length);
    return this.margin;
  }

  /** The limits of a command, where they lie in view. */
  _limits(u, name) {
    const limits = this.app.limits(name);
    if (!limits) return;
    const { ctx } = u;
    ctx.save();
    ctx.strokeStyle = this.app.look.bad;
    ctx.setLineDash([3, 5]);
    ctx.globalAlpha = 0.7;
    for (const limit of limits) {
      if (limit === null || limit < u.scales.y.min || limit > u.scales.y.max) continue;
      const y = u.valToPos(limit, "y", true);
      ctx.beginPath();
      ctx.moveTo(u.bbox.left, y);
      ctx.lineTo(u.bbox.left + u.bbox.width, y);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** All panels; of one turn after the other one at a time, each in every fourth turn or so. */
  draw(turn = null) {
    const { record, clockTime } = this.app;
    this.start = Math.max(0, clockTime - this.span);
    const first = Math.max(0, record.from(this.start) - 1);
    const end = record.from(clockTime + 1e-9);
    // A curve needs no more points than the screen has across.
    const stride = Math.max(1, Math.ceil((end - first) / Math.max(300, this.place.clientWidth)));
    const times = thinned(record.times, first, end, stride, 1);
    const round = Math.max(4, this.panels.length);
    this.panels.forEach((panel, j) => {
      if (turn === null || turn % round === j) panel.plot.setData([times, ...panel.lines.map((line) => thinned(line.column, first, end, stride, line.scale))]);
    });
  }

  /** The present values. */
  tell() {
    for (const panel of this.panels) {
      const { min = 0, max = 0 } = panel.plot.scales.y;
      const reach = Math.max(-min, max) / 1.12;
      panel.values.forEach((place, k) => {
        const value = this.app.record.columns[k][panel.name];
        const text = value ? steady(toShown(panel.signal, this.app.loops[k].get(panel.name)), reach) : "\u2013";
        if (place.textContent !== text) place.textContent = text;
      });
    }
  }
}

/** Every so many-th number; counted from a multiple of the stride, so that curves do not flicker while they scroll. */
function thinned(row, first, end, stride, scale) {
  if (stride === 1 && scale === 1) return row.subarray(first, end);
  const found = [];
  for (let k = Math.ceil(first / stride) * stride; k < end; k += stride) found.push(row[k] / scale);
  if (end > first) found.push(row[end - 1] / scale);
  return found;
}

/** An axis about these numbers, with air, and never so narrow that rounding fills it. */
function spread(low, high) {
  if (low === null || !Number.isFinite(low) || !Number.isFinite(high) || Math.max(-low, high) < 1e-12) return [-1, 1];
  const middle = (low + high) / 2;
  const least = Math.max(Math.abs(middle) * 0.02, 1e-12);
  const half = Math.max(((high - low) / 2) * 1.12, low === high ? Math.max(least, Math.abs(middle) * 0.1 || 1) : least);
  return [middle - half, middle + half];
}
