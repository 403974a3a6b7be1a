// `ulnaLoop`: a loop that can be started, stepped, pushed and put back. Names are data and stay data.

const OUTCOMES = ["running", "blown up", "not finite", "too stiff"];

function ulnaLoop(program, facts) {
  const m = new Float64Array(program.size);
  const at = (slot) => program.places[slot];
  const CODE = at("outcome"), K = at("samples"), TIME = at("time");
  const core = program.kind === "sampled" ? sampledCore(program) : flowingCore(program);
  const read = new Map(), inputs = new Map(), initial = new Map(), options = new Map();
  const parameters = { plant: new Map(), controller: new Map() };
  for (const { name, slot } of facts.signals) if (!read.has(name)) read.set(name, at(slot));
  for (const each of [...facts.references, ...facts.disturbances, ...(facts.held || [])]) inputs.set(each.name, at(each.given));
  for (const each of facts.initial) initial.set(each.name, each);
  for (const each of facts.parameters) parameters[each.owner].set(each.name, each);
  for (const each of facts.options) options.set(each.name, each);

  function known(map, name, what) {
    if (!map.has(name)) throw new RangeError(`this loop has no ${what} "${name}"`);
    return map.get(name);
  }

  function number(value, name) {
    if (typeof value !== "number" || !Number.isFinite(value)) throw new RangeError(`"${name}" needs a finite number`);
    return value;
  }

  const loop = {
    program,
    facts,
    memory: m,

    get time() { return m[TIME]; },
    get samples() { return m[K]; },
    get outcome() { return OUTCOMES[m[CODE]]; },
    get endedAt() { return m[CODE] ? m[at("ended")] : null; },

    get outcomeText() {
      const when = `at ${Number(m[at("ended")].toPrecision(4))} s`;
      return [
        "It is running.",
        `It blew up ${when}: a state grew without bound. Start it again nearer to its target.`,
        `It stopped ${when}: a number was no longer finite. Start it again from elsewhere.`,
        `It stopped ${when}: it moves too fast for the steps of this page. Start it again in slow motion.`,
      ][m[CODE]];
    },

    get limited() {
      return facts.commands.some(({ command, limited }) => m[at(command)] !== m[at(limited)]);
    },

    start(given = {}) {
      m.fill(0);
      for (const [slot, value] of Object.entries(program.begin)) m[at(slot)] = value;
      for (const each of facts.parameters) m[at(each.slot)] = each.value;
      for (const each of facts.initial) if (each.slot || each.wanted) m[at(each.slot ?? each.wanted)] = each.value;
      for (const each of [...facts.references, ...facts.disturbances, ...(facts.held || [])]) m[at(each.given)] = each.value;
      for (const each of facts.options) loop.setOption(each.name, each.value);
      m[at("seed")] = Math.floor(number(given.seed ?? 1, "seed"));
      for (const [name, value] of Object.entries(given.inputs ?? {})) loop.set(name, value);
      for (const [name, value] of Object.entries(given.options ?? {})) loop.setOption(name, value);
      for (const [name, value] of Object.entries(given.parameters ?? {})) {
        loop.setParameter(name, value, parameters.plant.has(name) ? "plant" : "controller");
      }
      const held = facts.commands.map((each) => each.value ?? 0);
      const wanted = Object.entries(given.initial ?? {});
      const estimates = wanted.filter(([name]) => known(initial, name, "state").wanted);
      if (estimates.length) {
        for (const [name, value] of estimates) m[at(initial.get(name).wanted)] = number(value, name);
        program.estimated(m);
      }
      for (const [name, value] of wanted) {
        const each = initial.get(name);
        if (each.slot) m[at(each.slot)] = number(value, name);
        else if (each.held !== undefined) held[each.held] = number(value, name);
      }
      core.begin(m, held);
      return loop;
    },

    step(count = 1) {
      for (let k = 0; k < count && m[CODE] === 0; k++) core.advance(m);
      return loop.outcome;
    },

    set(name, value) { m[known(inputs, name, "input")] = number(value, name); },
    input(name) { return m[known(inputs, name, "input")]; },

    setParameter(name, value, owner = "plant") {
      known(parameters[owner], name, `parameter of the ${owner}`);
      // Law and observer may both have one of this name.
      for (const each of facts.parameters) if (each.owner === owner && each.name === name) m[at(each.slot)] = number(value, name);
      if (owner === "plant") core.constants(m);
      else core.coefficients(m);
    },

    parameter(name, owner = "plant") { return m[at(known(parameters[owner], name, "parameter").slot)]; },

    setOption(name, value) {
      const each = known(options, name, "option");
      const wanted = each.kind === "switch" ? Number(Boolean(value)) : number(value, name);
      if (each.kind === "number" && !(wanted >= each.range[0] && wanted <= each.range[1])) {
        throw new RangeError(`"${name}" lies between ${each.range[0]} and ${each.range[1]}`);
      }
      m[at(`option_${name}`)] = wanted;
      core.option(m, name, wanted);
    },

    option(name) {
      const value = m[at(`option_${known(options, name, "option").name}`)];
      return options.get(name).kind === "switch" ? value !== 0 : value;
    },

    has(name) { return read.has(name); },
    index(name) { return known(read, name, "signal"); },
    get(name) { return m[known(read, name, "signal")]; },
    snapshot() { return m.slice(); },
    restore(row) { m.set(row); },

    copy() {
      const other = ulnaLoop(program, facts);
      other.restore(m);
      return other;
    },

    rates(state) {
      const row = m.slice();
      const found = new Float64Array(program.places.f0 === undefined ? 0 : facts.states.length);
      facts.states.forEach((each, k) => { row[at(`g${k}`)] = state[each.name] ?? row[at(each.slot)]; });
      core.rates(row);
      for (let k = 0; k < found.length; k++) found[k] = row[at(`f${k}`)];
      return found;
    },

    check() { return facts.vector ? checked(program, facts) : null; },
  };
  Object.defineProperty(loop, "core", { value: core });
  return loop.start();
}
