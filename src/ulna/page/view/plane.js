// The phase plane: where the states have been, where they rest, what is proved; and the poles.

class Plane {
  constructor(canvas, app) {
    this.app = app;
    this.sheet = new Sheet(canvas);
    this.cross = null; // where the keyboard's cross stands, in SI
    this.arrows = !app.replay && app.payload.loops.every((loop) => !loop.closed);
    canvas.addEventListener("click", (event) => this._start(this._value(this.sheet.at(event))));
    canvas.addEventListener("keydown", (event) => this._key(event));
    canvas.addEventListener("blur", () => this._leave());
    this.axes(app.payload.plane.x, app.payload.plane.y);
  }

  axes(x, y) {
    this.x = x;
    this.y = y;
    this.cross = null;
    this.forget();
  }

  forget() {
    this.low = [Infinity, Infinity];
    this.high = [-Infinity, -Infinity];
    const { app } = this;
    for (const rest of app.payload.equilibria) this._grow(rest.at[this.x], rest.at[this.y]);
    const outline = this._outline();
    if (outline) for (const [a, b] of outline) this._grow(a, b);
    for (const loop of app.loops) {
      const start = (name) => loop.facts.states.find((s) => s.name === name).value;
      this._grow(start(this.x), start(this.y));
    }
    for (const [a, b] of [[-1, -1], [1, 1]]) {
      const [x, y] = [this.x, this.y].map((name) => app.foreseen.get(name) ?? [0, 0]);
      this._grow(a < 0 ? x[0] : x[1], b < 0 ? y[0] : y[1]);
    }
    for (const k of [0, 1]) {
      const pad = Math.max((this.high[k] - this.low[k]) * 0.15, 0);
      const least = Math.max(Math.abs(this.low[k]), Math.abs(this.high[k])) * 0.2 || 1;
      this.low[k] -= Math.max(pad, least);
      this.high[k] += Math.max(pad, least);
    }
  }

  _outline() {
    const found = (this.app.payload.region?.outlines || []).find((each) => each.x === this.x && each.y === this.y);
    if (found) return found.points;
    const turned = (this.app.payload.region?.outlines || []).find((each) => each.x === this.y && each.y === this.x);
    return turned ? turned.points.map(([a, b]) => [b, a]) : null;
  }

  _grow(a, b) {
    [a, b].forEach((value, k) => {
      if (!Number.isFinite(value) || Math.abs(value) > 1e6) return;
      this.low[k] = Math.min(this.low[k], value);
      this.high[k] = Math.max(this.high[k], value);
    });
  }

  get box() {
    return { x: 52, y: 26, w: this.sheet.w - 64, h: this.sheet.h - 62 };
  }

  _place(a, b) {
    const { box } = this;
    return [
      box.x + ((a - this.low[0]) / (this.high[0] - this.low[0])) * box.w,
      box.y + box.h - ((b - this.low[1]) / (this.high[1] - this.low[1])) * box.h,
    ];
  }

  _value(point) {
    const { box } = this;
    return [
      this.low[0] + ((point[0] - box.x) / box.w) * (this.high[0] - this.low[0]),
      this.low[1] + ((box.y + box.h - point[1]) / box.h) * (this.high[1] - this.low[1]),
    ];
  }

  draw() {
    const { app, sheet, box } = this;
    const { look, record } = app;
    const c = sheet.c;
    const first = record.from(app.clockTime - 20 * app.pace);
    const end = record.from(app.clockTime + 1e-9);
    const stride = Math.max(1, Math.ceil(((end - first) * Math.max(2, app.loops.length)) / 1600));
    app.loops.forEach((loop) => {
      const [a, b] = [loop.get(this.x), loop.get(this.y)];
      const [wide, tall] = [0, 1].map((k) => 0.04 * (this.high[k] - this.low[k]));
      this._grow(a - wide, b - tall);
      this._grow(a + wide, b + tall);
    });
    // What a quick swing did between two drawings counts, too.
    for (const columns of record.columns) for (let j = first; j < end; j += 1) this._grow(columns[this.x][j], columns[this.y][j]);
    sheet.clear();
    this._axes(c, look);
    c.save();
    c.beginPath();
    c.rect(box.x, box.y, box.w, box.h);
    c.clip();
    this._region(c, look);
    this._walls(c, look);
    if (this.arrows) this._field(c, look);
    this._target(c, look);
    app.loops.forEach((loop, k) => {
      const [xs, ys] = [record.columns[k][this.x], record.columns[k][this.y]];
      c.beginPath();
      let drawn = false;
      for (let j = Math.ceil(first / stride) * stride; j < end; j += stride) {
        if (!Number.isFinite(xs[j])) continue;
        const at = this._place(xs[j], ys[j]);
        if (drawn) c.lineTo(...at);
        else c.moveTo(...at);
        drawn = true;
      }
      if (drawn) c.lineTo(...this._place(loop.get(this.x), loop.get(this.y)));
      c.strokeStyle = look.colour(k);
      c.lineWidth = 1.75;
      c.setLineDash(dashOf(k));
      c.stroke();
      c.setLineDash([]);
      disc(c, this._place(loop.get(this.x), loop.get(this.y)), 5, look.colour(k), look.back, 1.5);
    });
    this._rests(c, look);
    if (this.cross) this._drawCross(c, look);
    c.restore();
  }

  _axes(c, look) {
    const { box } = this;
    for (const tick of ticksBetween(this.low[0], this.high[0], Math.max(2, Math.floor(box.w / 70)))) {
      const [x] = this._place(tick, 0);
      line(c, [x, box.y], [x, box.y + box.h], look.rule, 1);
      label(c, words(tick), [x, box.y + box.h + 12], look.muted, { align: "center", size: 11 });
    }
    for (const tick of ticksBetween(this.low[1], this.high[1], Math.max(2, Math.floor(box.h / 45)))) {
      const [, y] = this._place(0, tick);
      line(c, [box.x, y], [box.x + box.w, y], look.rule, 1);
      label(c, words(tick), [box.x - 7, y], look.muted, { align: "right", size: 11 });
    }
    label(c, labelOf(this.app.signal(this.x)), [box.x + box.w, box.y + box.h + 28], look.ink, { align: "right" });
    label(c, labelOf(this.app.signal(this.y)), [6, 11], look.ink);
  }

  _region(c, look) {
    const outline = this._outline();
    if (!outline) return;
    c.beginPath();
    outline.forEach(([a, b], k) => (k ? c.lineTo(...this._place(a, b)) : c.moveTo(...this._place(a, b))));
    c.closePath();
    c.fillStyle = look.good;
    c.globalAlpha = 0.13;
    c.fill();
    c.globalAlpha = 1;
    c.strokeStyle = look.good;
    c.lineWidth = 1.5;
    c.stroke();
  }

  /** End stops, where they lie in view. */
  _walls(c, look) {
    const { box } = this;
    for (const { position, range } of this.app.loops[0].facts.stops || []) {
      for (const value of range) {
        if (value === null || ![this.x, this.y].includes(position)) continue;
        const [x, y] = position === this.x ? this._place(value, 0) : this._place(0, value);
        if (position === this.x) line(c, [x, box.y], [x, box.y + box.h], look.bad, 2);
        else line(c, [box.x, y], [box.x + box.w, y], look.bad, 2);
      }
    }
  }

  /** Which way the plant goes by itself, under the present command. */
  _field(c, look) {
    const loop = this.app.loops[0];
    const here = Object.fromEntries(loop.facts.states.map((s) => [s.name, loop.get(s.name)]));
    const places = [loop.facts.states.findIndex((s) => s.name === this.x), loop.facts.states.findIndex((s) => s.name === this.y)];
    const [columns, rows] = [15, 11];
    for (let i = 0; i < columns; i += 1) {
      for (let j = 0; j < rows; j += 1) {
        const a = this.low[0] + ((i + 0.5) * (this.high[0] - this.low[0])) / columns;
        const b = this.low[1] + ((j + 0.5) * (this.high[1] - this.low[1])) / rows;
        const rates = loop.rates({ ...here, [this.x]: a, [this.y]: b });
        const from = this._place(a, b);
        const to = this._place(a + rates[places[0]], b + rates[places[1]]);
        const size = Math.hypot(to[0] - from[0], to[1] - from[1]);
        if (!(size > 0) || !Number.isFinite(size)) continue;
        const [dx, dy] = [((to[0] - from[0]) / size) * 7, ((to[1] - from[1]) / size) * 7];
        line(c, [from[0] - dx, from[1] - dy], [from[0] + dx, from[1] + dy], look.muted, 1);
        disc(c, [from[0] + dx, from[1] + dy], 1.8, look.muted);
      }
    }
  }

  _target(c, look) {
    [this.x, this.y].forEach((name, k) => {
      const value = this.app.targetOf(name);
      if (value === null) return;
      const at = k ? this._place(0, value) : this._place(value, 0);
      const { box } = this;
      if (k) line(c, [box.x, at[1]], [box.x + box.w, at[1]], look.ink, 1.25, [5, 5]);
      else line(c, [at[0], box.y], [at[0], box.y + box.h], look.ink, 1.25, [5, 5]);
    });
  }

  _rests(c, look) {
    for (const rest of this.app.payload.equilibria) {
      const at = this._place(rest.at[this.x], rest.at[this.y]);
      disc(c, at, 5, rest.stable ? look.ink : look.back, look.ink, 2);
    }
  }

  _drawCross(c, look) {
    const at = this._place(...this.cross);
    line(c, [at[0] - 12, at[1]], [at[0] + 12, at[1]], look.accent, 2);
    line(c, [at[0], at[1] - 12], [at[0], at[1] + 12], look.accent, 2);
  }

  _leave() {
    if (!this.cross) return;
    this.cross = null;
    this.app.changed();
  }

  _start(value) {
    if (!value.every(Number.isFinite)) return;
    this.app.startFrom({ [this.x]: value[0], [this.y]: value[1] });
  }

  _key(event) {
    if (this.app.replay) return;
    const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (move) {
      const loop = this.app.loops[0];
      const at = this.cross || [loop.get(this.x), loop.get(this.y)];
      const share = event.shiftKey ? 0.1 : 0.02;
      this.cross = at.map((value, k) => clamp(value + move[k] * share * (this.high[k] - this.low[k]), this.low[k], this.high[k]));
      this.app.say(`${this.x} ${words(this.cross[0], 3)}, ${this.y} ${words(this.cross[1], 3)}: Enter starts from here.`);
    } else if (event.key === "Enter" && this.cross) {
      this._start(this.cross);
    } else if (event.key === "Escape") {
      this.cross = null;
    } else return;
    event.preventDefault();
    this.app.changed();
  }
}

/** The poles of every loop about its rest point: the left half is stable. */
function drawPoles(sheet, app) {
  const { look } = app;
  const { c } = sheet;
  sheet.clear();
  const box = { x: 10, y: 10, w: sheet.w - 20, h: sheet.h - 36 };
  const poles = app.payload.loops.flatMap((loop, k) => loop.poles.map(([re, im]) => ({ re, im, k })));
  const left = niceAbove(Math.max(...poles.map((p) => -p.re), 0.5) * 1.1);
  const right = Math.max(niceAbove(Math.max(...poles.map((p) => p.re), 0) * 1.15 || 1e-9), left * 0.15);
  const tall = niceAbove(Math.max(...poles.map((p) => Math.abs(p.im)), (left + right) / 3) * 1.1);
  const place = (re, im) => [box.x + ((re + left) / (left + right)) * box.w, box.y + box.h / 2 - (im / tall) * (box.h / 2)];
  c.fillStyle = look.surface;
  c.fillRect(box.x, box.y, place(0, 0)[0] - box.x, box.h);
  line(c, place(-left, 0), place(right, 0), look.muted, 1);
  line(c, place(0, -tall), place(0, tall), look.muted, 1);
  for (const tick of ticksBetween(-left, right, 4)) {
    const at = place(tick, 0);
    if (at[0] < box.x + 12 || at[0] > box.x + box.w - 8) continue;
    line(c, [at[0], at[1] - 3], [at[0], at[1] + 3], look.muted, 1);
    label(c, words(tick), [at[0], box.y + box.h + 9], look.muted, { align: "center", size: 11 });
  }
  for (const sign of [-1, 1]) label(c, words(sign * tall), [place(0, 0)[0] + 5, place(0, sign * tall)[1] + sign * 8], look.muted, { size: 11 });
  for (const pole of poles) {
    const at = place(pole.re, pole.im);
    for (const way of [1, -1]) line(c, [at[0] - 5, at[1] - 5 * way], [at[0] + 5, at[1] + 5 * way], look.colour(pole.k), 2.25);
  }
}
