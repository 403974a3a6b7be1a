// The panels below the picture: set points, pushes, parameters, hardware, the start.

const GRIP = 0.7; // effort of a muscle that a button or a key holds

class Controls {
  constructor(app) {
    this.app = app;
    this.fields = []; // [{set, read}]: renewed after a rewind or an address
    if (app.replay) {
      for (const id of ["held", "set-points", "pushes", "parameters-fold", "hardware-fold", "starts-fold"]) byId(id).hidden = true;
      return;
    }
    this._held(byId("held"));
    this._setPoints(byId("set-points"));
    this._pushes(byId("pushes"));
    this._parameters(byId("parameters"));
    this._options(byId("hardware"));
    this._starts(byId("starts"));
  }

  /** Show what the loops hold now. */
  renew() {
    for (const field of this.fields) field.set(field.read());
  }

  _keep(field, read) {
    this.fields.push({ set: field.set, read });
    return field.root;
  }

  /** What a hand holds to move the set points: a slider that stays, a button and a key that act while they are held. */
  _held(place) {
    const { app } = this;
    const rows = app.loops[0].facts.held || [];
    place.hidden = !rows.length;
    if (!rows.length) return;
    const buttons = el("div", { class: "buttons" });
    this.keys = new Map();
    for (const item of rows) {
      const read = () => app.loops[0].get(item.name);
      const shown = { ...item, unit: "%", scale: 0.01 };
      const held = (value) => () => { app.hold(item.name, value); this.renew(); };
      buttons.append(holdButton(`hold ${item.name} (${item.key.toUpperCase()})`, held(GRIP), held(0)));
      this.keys.set(item.key, [held(GRIP), held(0)]);
      place.append(this._keep(slider({ name: item.name, item: shown, low: 0, high: 1, value: 0, text: "effort", on: (value) => app.hold(item.name, value) }), read));
    }
    place.prepend(buttons);
    const item = app.loops[0].facts.options.find((each) => each.name === "source");
    const on = toggle(item.name, item.text, app.led, (value) => (value ? app.loops.forEach((_, k) => app.setOption(k, "source", true)) : app.letGo()));
    place.append(this._keep(on, () => app.led));
  }

  _setPoints(place) {
    const { app } = this;
    for (const target of app.targets) {
      const read = () => app.input(target.name);
      const field = slider({
        name: `set point of ${target.output}`, item: target.row, low: target.range[0], high: target.range[1], value: read(), text: "",
        on: (value) => app.setInput(target.name, value),
      });
      place.append(this._keep(field, read));
    }
    if (!app.targets.length && app.payload.loops.some((loop) => loop.closed)) {
      place.append(el("p", { class: "quiet" }, "This controller holds the operating point and takes no set point."));
    }
    place.hidden = !place.children.length;
  }

  _pushes(place) {
    const { app } = this;
    const row = el("div", { class: "buttons" });
    for (const push of app.pushes.slice(0, 3)) {
      const held = (sign) => [() => app.push(push, sign * push.strength), () => app.push(push, 0)];
      const name = push.position;
      row.append(el("span", { class: "pair" },
        holdButton(`\u2212 push ${name}`, ...held(-1), { "aria-label": `Push ${name} down the scale while held` }),
        holdButton(`push ${name} +`, ...held(1), { "aria-label": `Push ${name} up the scale while held` })));
    }
    if (app.load) {
      const text = () => (app.loadCarried ? `Drop the load (${app.load.name})` : `Pick up the load (${app.load.name})`);
      this.loadButton = el("button", { type: "button", on: { click: () => app.toggleLoad() } }, text());
      this.fields.push({ set: () => { this.loadButton.textContent = text(); }, read: () => null });
      row.append(this.loadButton);
    }
    if (row.children.length) place.append(row);
    if (app.pushes.length) {
      const push = app.pushes[0];
      const field = slider({
        name: "strength", item: { unit: push.row.unit, scale: 1 }, low: 0, high: push.strength * 5, value: push.strength,
        text: "of a push", on: (value) => { for (const each of app.pushes) each.strength = value; },
      });
      place.append(field.root);
    }
    for (const item of app.disturbances) {
      const read = () => app.input(item.name);
      const [low, high] = rangeOf(item, item.value);
      place.append(this._keep(slider({ name: item.name, item, low: item.range && item.range[0] !== null ? low : Math.min(low, -high), high, value: read(), text: item.text || (app.payload.loops.some((loop) => loop.closed) ? "disturbance" : "input"),
        on: (value) => app.setInput(item.name, value) }), read));
    }
    place.hidden = !place.children.length;
  }

  _parameters(place) {
    const { app } = this;
    const several = app.loops.length > 1;
    const own = app.loops.flatMap((loop, k) => loop.facts.parameters.map((item) => ({ item, k })));
    const plant = own.filter(({ item }, j) => item.owner === "plant" && own.findIndex((each) => each.item.name === item.name) === j);
    for (const { item } of plant) place.append(this._parameter(0, item));
    if (plant.length && app.payload.loops.some((loop) => loop.closed)) {
      place.prepend(el("p", { class: "quiet" }, "A controller keeps the numbers it was designed with: here you see what it does when the plant differs."));
    }
    app.loops.forEach((loop, k) => {
      const named = new Map(loop.facts.parameters.filter((item) => item.owner !== "plant").map((item) => [item.name, item]));
      if (!named.size) return;
      place.append(el("h3", {}, several ? `Controller: ${app.payload.loops[k].title}` : "Controller"));
      for (const item of named.values()) place.append(this._parameter(k, item));
    });
    byId("parameters-fold").hidden = !place.children.length;
  }

  _parameter(k, item) {
    const { app } = this;
    const read = () => app.parameter(item.name, k, item.owner);
    const [low, high] = rangeOf(item, item.value);
    return this._keep(slider({ name: item.name, item, low, high, value: read(), text: item.text,
      on: (value) => app.setParameter(k, item.owner, item.name, value), reset: () => item.value }), read);
  }

  _options(place) {
    const { app } = this;
    const several = app.loops.length > 1;
    app.loops.forEach((loop, k) => {
      for (const item of loop.facts.options.filter((each) => each.name !== "source")) {
        const read = () => app.settings[k].options[item.name] ?? item.value;
        const text = (item.text || item.name) + (several ? ` (${app.payload.loops[k].title})` : "");
        if (item.kind === "switch") place.append(this._keep(toggle(item.name, text, read(), (on) => app.setOption(k, item.name, on)), read));
        else {
          const [low, high] = rangeOf(item, item.value);
          place.append(this._keep(slider({ name: several ? text : item.name, item, low, high, value: read(), text: several ? "" : item.text,
            on: (value) => app.setOption(k, item.name, value), reset: () => item.value }), read));
        }
      }
    });
    const said = [...new Set(app.loops.map((loop) => loop.facts.integrator).filter(Boolean))];
    for (const sentence of said) place.append(el("p", { class: "quiet" }, sentence));
    byId("hardware-fold").hidden = !place.children.length;
  }

  _starts(place) {
    const { app } = this;
    for (const item of app.loops[0].facts.states) {
      const read = () => app.initial[item.name] ?? item.value;
      const [low, high] = rangeOf(item, item.value);
      const symmetric = item.range && item.range[0] !== null ? low : Math.min(low, -high);
      place.append(this._keep(slider({ name: item.name, item, low: symmetric, high, value: read(), text: item.text,
        on: (value) => { app.initial[item.name] = value; app.noteAddress(); } }), read));
    }
    place.append(el("div", { class: "buttons" },
      el("button", { type: "button", on: { click: () => app.restart() } }, "Start from here"),
      el("button", { type: "button", on: { click: () => { app.initial = {}; app.restart(); } } }, "Back to the first start")));
  }
}
