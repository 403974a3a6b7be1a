// The table of live figures: what a run has cost and how well it follows, one column a controller.

class Figures {
  constructor(place, app) {
    this.app = app;
    const { payload } = app;
    const part = payload.picture?.parts?.current;
    this.command = app.loops.map((loop) => loop.facts.commands[0] || null);
    const volts = this.command.every((u) => u && u.unit === "V");
    this.current = typeof part === "string" && volts && app.signal(part).unit === "A" ? part : null;
    this.rows = this._rows();
    const head = el("tr", {}, el("td", {}), ...payload.loops.map((loop, k) =>
      el("th", { scope: "col" }, el("span", { class: `swatch s${k % 7}` }, payload.loops.length > 1 ? loop.title : "now"))));
    this.cells = this.rows.map((row) => app.loops.map(() => el("td", { class: "number" })));
    const body = this.rows.map((row, j) => el("tr", {}, el("th", { scope: "row" }, row.text,
      row.unit ? el("span", { class: "unit" }, ` ${row.unit}`) : null), ...this.cells[j]));
    place.replaceChildren(el("table", {}, el("thead", {}, head), el("tbody", {}, ...body)));
    this.forget();
  }

  forget() {
    this.state = this.app.loops.map(() => ({ time: null, peak: 0, effort: 0, energy: 0, peakCurrent: 0, jumpAt: 0, jump: 0, settledAt: null }));
  }

  /** A set point has moved: settling is counted from here. */
  jumped() {
    this.state.forEach((state, k) => {
      state.jumpAt = this.app.loops[k].time;
      state.jump = Math.abs(this._error(k) ?? 0);
      state.settledAt = null;
    });
  }

  _rows() {
    const { app } = this;
    const rows = [];
    const target = app.targets[0];
    const u = this.command.find(Boolean);
    if (target) {
      rows.push({ text: `error of ${target.output}`, unit: unitText(target.row), value: (k) => this._error(k), reach: (k) => this.state[k].jump });
      rows.push({ text: "settled within 2 %, after", unit: "s", value: (k) => this.state[k].settledAt });
    }
    if (u) {
      rows.push({ text: `command ${u.name}`, unit: unitText(u), value: (k) => this._u(k), reach: (k) => this.state[k].peak });
      rows.push({ text: `largest |${u.name}|`, unit: unitText(u), value: (k) => this.state[k].peak });
    }
    if (this.current) {
      const item = app.signal(this.current);
      rows.push({ text: `largest |${this.current}|`, unit: unitText(item), value: (k) => this.state[k].peakCurrent });
      rows.push({ text: "power now", unit: "W", value: (k) => this._power(k) });
      rows.push({ text: "energy drawn", unit: "J", value: (k) => this.state[k].energy });
    } else if (u) {
      rows.push({ text: `\u222b ${u.name}\u00b2 dt`, unit: unitText(u) ? `${/^[A-Za-z]+$/.test(unitText(u)) ? unitText(u) : `(${unitText(u)})`}\u00b2\u00b7s` : "s", value: (k) => this.state[k].effort });
    }
    if (!rows.length) {
      for (const state of app.loops[0].facts.states.slice(0, 8)) {
        rows.push({ text: state.text || state.name, unit: unitText(state), value: (k) => app.loops[k].get(state.name),
          reach: () => Math.max(...(app.foreseen.get(state.name) ?? [0]).map(Math.abs)) });
      }
    }
    return rows;
  }

  _error(k) {
    const target = this.app.targets[0];
    if (!target) return null;
    return toShown(target.row, this.app.input(target.name) - this.app.loops[k].get(target.output));
  }

  _u(k) {
    const u = this.command[k];
    return u ? toShown(u, this.app.loops[k].get(u.name)) : null;
  }

  _power(k) {
    const u = this.command[k];
    return u ? this.app.loops[k].get(u.name) * this.app.loops[k].get(this.current) : null;
  }

  note(loop, k) {
    const state = this.state[k];
    const passed = state.time === null ? 0 : loop.time - state.time;
    state.time = loop.time;
    if (passed < 0) return;
    const u = this._u(k);
    if (u !== null && Number.isFinite(u)) {
      state.peak = Math.max(state.peak, Math.abs(u));
      state.effort += u * u * passed;
    }
    if (this.current && Number.isFinite(loop.get(this.current))) {
      state.peakCurrent = Math.max(state.peakCurrent, Math.abs(loop.get(this.current)));
      state.energy += this._power(k) * passed;
    }
    const error = Math.abs(this._error(k) ?? 0);
    if (state.jump > 0) {
      if (error > 0.02 * state.jump) state.settledAt = null;
      else if (state.settledAt === null) state.settledAt = loop.time - state.jumpAt;
    }
  }

  draw() {
    this.rows.forEach((row, j) => this.app.loops.forEach((_, k) => {
      const text = steady(row.value(k), row.reach ? row.reach(k) : null);
      const cell = this.cells[j][k];
      if (cell.textContent !== text) cell.textContent = text;
    }));
  }
}
