// A loop with a processor: the sequence of the simulator around the kernels of the program.

const MOST_STEPS = 4096;

function sampledCore(program) {
  const at = (name) => program.places[name];
  const row = (stem, count) => Array.from({ length: count }, (_, k) => at(stem + k));
  const { driven, measured, rows } = program;
  const states = row("x", program.states), was = new Float64Array(program.states);
  const K = at("samples"), TIME = at("time"), SPAN = at("span"), CLOCK = at("clock"), BEGUN = at("begun");
  const EARLIER = at("earlier"), NEXT = at("next"), PERIOD = at("period"), FRACTION = at("fraction");
  const STEPS = at("steps"), PACE = at("pace"), FAULT = at("fault"), CODE = at("outcome"), ENDED = at("ended");
  const WHOLE = at("whole_delay"), DRIVE = at("option_drive"), BOUND = at("bound_square");
  const commands = row("c", driven), believed = row("believed", driven), late = row("late", driven);
  const early = row("early", driven), before = row("ua", driven), after = row("ub", driven);
  const lines = Array.from({ length: driven }, (_, k) => Array.from({ length: rows + 1 }, (_, j) => at(`h${k}_${j}`)));
  const noises = program.noises.map((k) => [at(`noise${k}`), 2 * k, at(`std${k}`)]);
  const streams = 2 * measured + 2;
  const round = program.single ? Math.fround : (value) => value;
  const source = program.source, SOURCE = source ? at("option_source") : 0;
  let seed = 1n, ofSeed = NaN;

  function seeded(m) {
    const given = m[at("seed")];
    if (given !== ofSeed) {
      ofSeed = given;
      seed = scrambled(BigInt(given));
    }
    return seed;
  }

  // What a hand holds moves the set points: once a sample, with noise of its own.
  function led(m) {
    const streams = source.noises.length, own = seeded(m) ^ 0x5DEECE66Dn;
    source.noises.forEach((place, k) => { m[place] = normal(own, 2 * (m[K] * streams + k)); });
    program.lead(m);
  }

  function beginsToLead(m) {
    for (const place of source.memory) m[place] = 0;
    for (const [place, given] of source.starts) m[place] = m[given];
  }

  // What the drive gets from the delay line, at the delay that is set now.
  function tapped(m) {
    const whole = m[WHOLE], fraction = round(m[FRACTION]), split = fraction !== 0 ? 1 : 0;
    for (let k = 0; k < driven; k++) {
      const newer = m[lines[k][whole]], older = m[lines[k][whole + split]];
      m[late[k]] = newer;
      m[early[k]] = older;
      m[believed[k]] = split ? round(newer + round(fraction * round(older - newer))) : newer;
    }
  }

  function driveless(m) {
    for (let k = 0; k < driven; k++) {
      m[before[k]] = m[early[k]];
      m[after[k]] = m[late[k]];
    }
  }

  // As many steps of the plant as it needs now, never fewer than the recorded run took.
  function paced(m) {
    const fraction = m[FRACTION];
    const stretch = program.retimed ? (fraction ? Math.max(fraction, 1 - fraction) : 1) : program.stretch;
    const wanted = (Math.pow(m[PACE], 1 / program.rounds) * stretch) / program.within;
    const needed = Math.pow(2, Math.ceil(Math.log2(Math.max(wanted, 1))));
    const least = m[at("least_steps")];
    if (needed > m[STEPS]) m[STEPS] = Math.min(needed, MOST_STEPS);
    else if (needed * 4 <= m[STEPS]) m[STEPS] = Math.max(least, m[STEPS] / 2);
    m[PACE] = 0;
  }

  const core = {
    adapts: true,

    begin(m, held) {
      for (let k = 0; k < driven; k++) {
        for (const place of [commands[k], believed[k], late[k], early[k], before[k], after[k], ...lines[k]]) {
          m[place] = held[k];
        }
      }
      program.constants(m);
      m[K] = 0;
      if (source) beginsToLead(m);
      if (program.jittered) m[TIME] = m[NEXT] = m[at("jitter")] * uniform(seeded(m), 2 * measured);
      core.sample(m);
    },

    sample(m) {
      const k = m[K], period = m[PERIOD];
      m[CLOCK] = (k + 1) * period;
      m[BEGUN] = k > 0 ? 1 : 0;
      if (program.jittered) {
        m[EARLIER] = m[TIME];
        m[TIME] = m[NEXT];
        m[NEXT] = m[CLOCK] + m[at("jitter")] * uniform(seeded(m), (k + 1) * streams + 2 * measured);
      } else {
        m[TIME] = k * period;
        m[EARLIER] = (k - 1) * period;
        m[SPAN] = period;
      }
      if (program.timed) m[at("elapsed")] = program.jittered ? m[TIME] - m[EARLIER] : period;
      if (source && m[SOURCE]) led(m);
      for (const [place, given] of program.entries) m[place] = m[given] + 0;
      for (const [place, stream, std] of noises) {
        if (core.given === undefined) m[place] = m[std] === 0 ? 0 : normal(seeded(m), k * streams + stream);
      }
      if (program.missing) {
        const drawn = uniform(seeded(m), k * streams + 2 * measured + 1);
        m[at("missed")] = drawn < m[at("missed_share")] && k > 0 ? 1 : 0;
      }
      program.shown(m);
      program.sense(m);
      program.command(m);
      if (program.retimed) tapped(m);
      if (m[DRIVE]) program.apply(m);
      else driveless(m);
      if (k % program.paced === 0) {
        program.pace(m);
        if (core.adapts) paced(m);
      }
    },

    advance(m) {
      for (let k = 0; k < states.length; k++) was[k] = m[states[k]];
      if (program.jittered) m[SPAN] = m[NEXT] - m[TIME];
      program.motion(m);
      let norm = program.safe ? 0 : m[FAULT];
      for (const place of states) norm += m[place] * m[place];
      if (!(norm < m[BOUND])) {
        const flown = norm - norm === 0;
        m[CODE] = flown ? 1 : 2;
        m[ENDED] = flown ? m[TIME] + m[SPAN] : m[TIME];
        if (!flown) states.forEach((place, k) => { m[place] = was[k]; });
        return;
      }
      m[K] += 1;
      core.sample(m);
    },

    // Where the coefficients of the controller come from other parameters than its own.
    coefficients(m) {
      program.coefficients(m);
      for (const name of Object.keys(program.places)) {
        if (name.startsWith("set_")) m[at(name.slice(4))] = m[at(name)];
      }
    },

    constants: program.constants,

    option(m, name, value) {
      if (name === "delay") {
        const periods = value / m[PERIOD], whole = Math.floor(periods + 1e-9);
        const fraction = periods - whole;
        m[WHOLE] = whole;
        m[FRACTION] = fraction > 1e-9 ? fraction : 0;
        return;
      }
      if (name === "source") {
        if (value) beginsToLead(m);
        return;
      }
      for (const [slot, without] of program.switches[name] || []) m[at(slot)] = value ? program.begin[slot] : without;
    },

    rates(m) {
      program.field(m);
    },
  };
  return core;
}
