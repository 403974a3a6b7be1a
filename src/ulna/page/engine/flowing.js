// A loop without a processor, or a plant alone: Dormand and Prince's steps of order 5 with error control
// (J. R. Dormand, P. J. Prince, J. Comp. Appl. Math. 6, 1980), or the difference equation of discrete time.

const NODES = [
  [],
  [1 / 5],
  [3 / 40, 9 / 40],
  [44 / 45, -56 / 15, 32 / 9],
  [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
  [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
  [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
];
const ERRORS = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40];

function flowingCore(program) {
  const at = (name) => program.places[name];
  const n = program.states;
  const X = at("x0"), G = at("g0"), F = at("f0");
  const K = at("samples"), TIME = at("time"), PERIOD = at("period"), LIMITS = at("limits"), STEP = at("step");
  const CODE = at("outcome"), ENDED = at("ended"), BOUND = at("bound_square");
  const slopes = Array.from({ length: 7 }, () => new Float64Array(n));
  const rates = (m) => (program.limited && !m[LIMITS] ? program.rates_free(m) : program.rates(m));

  function constants(m) {
    program.constants(m);
    if (program.limited) program.constants_free(m);
  }

  function shown(m) {
    if (program.limited) {
      program.shown_free(m);
      for (const [from, to] of program.commands) m[to] = m[from];
      if (!m[LIMITS]) return;
    }
    program.shown(m);
  }

  function slope(m, k) {
    rates(m);
    for (let i = 0; i < n; i++) slopes[k][i] = m[F + i];
  }

  // One step of length h from x; the largest error over its tolerance. The new state stands in g.
  function tried(m, h) {
    for (let i = 0; i < n; i++) m[G + i] = m[X + i];
    slope(m, 0);
    for (let stage = 1; stage < 7; stage++) {
      const row = NODES[stage];
      for (let i = 0; i < n; i++) {
        let sum = 0;
        for (let j = 0; j < stage; j++) sum += row[j] * slopes[j][i];
        m[G + i] = m[X + i] + h * sum;
      }
      slope(m, stage);
    }
    let worst = 0;
    for (let i = 0; i < n; i++) {
      let error = 0;
      for (let j = 0; j < 7; j++) error += ERRORS[j] * slopes[j][i];
      const size = Math.max(Math.abs(m[X + i]), Math.abs(m[G + i]));
      const found = Math.abs(h * error) / (program.tolerance * (1e-3 + size));
      if (!(found <= worst)) worst = found;
    }
    return worst;
  }

  function walls(m) {
    for (const [position, velocity, low, high, bounce] of program.walls) {
      const x = m[X + position], v = m[X + velocity];
      if (x >= high) {
        m[X + position] = high;
        if (v > 0) m[X + velocity] = -bounce * v;
      } else if (x <= low) {
        m[X + position] = low;
        if (v < 0) m[X + velocity] = -bounce * v;
      }
    }
  }

  function moved(m) {
    const period = m[PERIOD];
    let gone = 0, h = m[STEP] > 0 ? Math.min(m[STEP], period) : period;
    for (let count = 0; count < program.most; count++) {
      const last = period - gone <= h * 1.000001;
      const length = last ? period - gone : h;
      const worst = tried(m, length);
      const factor = worst > 0 ? 0.9 * Math.pow(worst, -0.2) : 5;
      if (worst <= 1) {
        for (let i = 0; i < n; i++) m[X + i] = m[G + i];
        walls(m);
        gone += length;
        const next = length * Math.min(5, Math.max(0.2, factor));
        // A last step that was cut short says nothing against the step before it.
        h = last ? Math.max(h, next) : next;
        if (last) {
          m[STEP] = h;
          return 0;
        }
      } else {
        h = length * (worst < Infinity ? Math.max(0.1, factor) : 0.1);
      }
      if (!(h > 1e-12 * period)) return Number.isFinite(worst) ? 3 : 2;
    }
    return 3;
  }

  const core = {
    adapts: true,

    begin(m) {
      constants(m);
      m[K] = 0;
      core.sample(m);
    },

    sample(m) {
      m[TIME] = m[K] * m[PERIOD];
      for (const [place, given] of program.entries) m[place] = m[given];
      shown(m);
    },

    advance(m) {
      let code = 0;
      if (program.kind === "discrete") {
        for (let i = 0; i < n; i++) m[G + i] = m[X + i];
        rates(m);
        for (let i = 0; i < n; i++) m[X + i] = m[F + i];
      } else {
        code = moved(m);
      }
      let norm = 0;
      for (let i = 0; i < n; i++) norm += m[X + i] * m[X + i];
      if (!(norm < m[BOUND])) code = norm - norm === 0 ? 1 : 2;
      m[K] += 1;
      if (code) {
        m[CODE] = code;
        m[ENDED] = m[K] * m[PERIOD];
        return;
      }
      core.sample(m);
    },

    constants,

    option(m, name, value) {
      if (name === "limits") m[LIMITS] = value ? 1 : 0;
    },

    rates,
  };
  return core;
}
