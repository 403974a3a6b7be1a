"""Plants with the dimension and class of their zero dynamics, worked out by hand.

Longer than 400 lines because it is one table.
"""

from __future__ import annotations

from typing import Any

from ulna.system import System, system_from_mapping

UNICYCLE = ({"x": "v*cos(q)", "y": "v*sin(q)", "q": "w"}, ["v", "w"], ["x", "y"])


def plant(
    states: dict[str, str],
    inputs: list[str],
    outputs: list[str],
    point: dict[str, Any] | None = None,
    parameters: dict[str, Any] | None = None,
) -> System:
    return system_from_mapping(
        {
            "name": "plant",
            "states": states,
            "inputs": {u: {} for u in inputs},
            "outputs": {f"y_{k + 1}": h for k, h in enumerate(outputs)},
            "operating_point": point or {},
            "parameters": {p: {} if v is None else {"value": v} for p, v in (parameters or {}).items()},
        }
    )


# name: (states, inputs, outputs, operating point, parameters), dimension and class of the zero dynamics
PLANTS: dict[str, tuple[tuple[Any, ...], int, str]] = {
    "mass_spring_collocated": (
        (
            {"x1": "x2", "x2": "(-k*(x1-x3)-c*(x2-x4)+u)/m1", "x3": "x4", "x4": "(k*(x1-x3)+c*(x2-x4)-k2*x3)/m2"},
            ["u"],
            ["x1"],
            {},
            {"k": 1, "c": 0, "m1": 1, "m2": 2, "k2": 3},
        ),
        2,
        "marginal",
    ),
    "mass_spring_damped": (
        (
            {"x1": "x2", "x2": "(-k*(x1-x3)-c*(x2-x4)+u)/m1", "x3": "x4", "x4": "(k*(x1-x3)+c*(x2-x4)-k2*x3)/m2"},
            ["u"],
            ["x1"],
            {},
            {"k": 1, "c": 0.2, "m1": 1, "m2": 2, "k2": 3},
        ),
        2,
        "exponential",
    ),
    "mass_spring_noncollocated": (
        (
            {"x1": "x2", "x2": "(-k*(x1-x3)+u)/m1", "x3": "x4", "x4": "k*(x1-x3)/m2"},
            ["u"],
            ["x3"],
            {},
            {"k": 1, "m1": 1, "m2": 2},
        ),
        0,
        "exponential",
    ),
    "cart_pendulum_cart_up": (
        (
            {
                "p": "v",
                "v": "(u+m*l*w**2*sin(q)-m*g*sin(q)*cos(q))/(M+m*sin(q)**2)",
                "q": "w",
                "w": "(-u*cos(q)-m*l*w**2*sin(q)*cos(q)+(M+m)*g*sin(q))/(l*(M+m*sin(q)**2))",
            },
            ["u"],
            ["p"],
            {},
            {"m": 0.2, "M": 1, "l": 0.5, "g": 9.81},
        ),
        2,
        "unstable",
    ),
    "cart_pendulum_cart_down": (
        (
            {
                "p": "v",
                "v": "(u+m*l*w**2*sin(q)+m*g*sin(q)*cos(q))/(M+m*sin(q)**2)",
                "q": "w",
                "w": "(-u*cos(q)-m*l*w**2*sin(q)*cos(q)-(M+m)*g*sin(q))/(l*(M+m*sin(q)**2))",
            },
            ["u"],
            ["p"],
            {},
            {"m": 0.2, "M": 1, "l": 0.5, "g": 9.81},
        ),
        2,
        "marginal",
    ),
    "cart_pendulum_down_damped": (
        (
            {"p": "v", "v": "u", "q": "w", "w": "(-u*cos(q)-g*sin(q)-b*w)/l"},
            ["u"],
            ["p"],
            {},
            {"b": 0.1, "l": 0.5, "g": 9.81},
        ),
        2,
        "exponential",
    ),
    "cart_pendulum_angle": (
        ({"p": "v", "v": "u", "q": "w", "w": "(-u*cos(q)+g*sin(q))/l"}, ["u"], ["q"], {}, {"l": 0.5, "g": 9.81}),
        2,
        "unstable",
    ),
    "tora_angle": (
        ({"x1": "x2", "x2": "-x1+e*sin(x3)", "x3": "x4", "x4": "u"}, ["u"], ["x3"], {}, {"e": 0.1}),
        2,
        "marginal",
    ),
    "tora_position": (
        (
            {
                "x1": "x2",
                "x2": "(-x1+e*x4**2*sin(x3)-e*cos(x3)*u)/(1-e**2*cos(x3)**2)",
                "x3": "x4",
                "x4": "(e*cos(x3)*(x1-e*x4**2*sin(x3))+u)/(1-e**2*cos(x3)**2)",
            },
            ["u"],
            ["x1"],
            {},
            {"e": 0.1},
        ),
        2,
        "unstable",
    ),
    "ball_beam": (
        ({"r": "v", "v": "B*(r*w**2-G*sin(q))", "q": "w", "w": "u"}, ["u"], ["r"], {}, {"B": 0.7143, "G": 9.81}),
        0,
        "exponential",
    ),
    "ball_beam_angle": (
        ({"r": "v", "v": "B*(r*w**2-G*sin(q))", "q": "w", "w": "u"}, ["u"], ["q"], {}, {"B": 0.7143, "G": 9.81}),
        2,
        "unstable",
    ),
    "cstr": (
        ({"c": "1-c-D*c*exp(T)", "T": "-T+H*D*c*exp(T)+b*(u-T)"}, ["u"], ["T"], {"c": 0.5}, {"D": 1, "H": 1, "b": 0.3}),
        1,
        "exponential",
    ),
    "cstr_conc": (
        ({"c": "1-c-D*c*exp(T)", "T": "-T+H*D*c*exp(T)+b*(u-T)"}, ["u"], ["c"], {"c": 0.5}, {"D": 1, "H": 1, "b": 0.3}),
        0,
        "exponential",
    ),
    "vandevusse_T": (
        (
            {"a": "-k1*a-k3*a**2+(f-a)*u", "b": "k1*a-k2*b-b*u"},
            ["u"],
            ["b"],
            {"a": 2.5, "b": 1},
            {"k1": 50, "k2": 100, "k3": 10, "f": 10},
        ),
        1,
        "unstable",
    ),
    "bioreactor": (
        (
            {"X": "mu*S*X/(K+S)-D*X", "S": "-mu*S*X/(Y*(K+S))+D*(Sf-S)"},
            ["D"],
            ["S"],
            {"X": 1, "S": 1},
            {"mu": 1, "K": 1, "Y": 1, "Sf": 2},
        ),
        1,
        "exponential",
    ),
    "bioreactor_X": (
        (
            {"X": "mu*S*X/(K+S)-D*X", "S": "-mu*S*X/(Y*(K+S))+D*(Sf-S)"},
            ["D"],
            ["X"],
            {"X": 1, "S": 1},
            {"mu": 1, "K": 1, "Y": 1, "Sf": 2},
        ),
        1,
        "exponential",
    ),
    "aircraft_pitch": (
        (
            {"th": "q", "al": "q-La*al-Ld*de", "q": "-Ma*al-Mq*q-Md*de", "h": "V*(th-al)"},
            ["de"],
            ["h"],
            {},
            {"La": 0.8, "Ld": 0.1, "Ma": 3, "Mq": 1, "Md": 5, "V": 50},
        ),
        2,
        "unstable",
    ),
    "aircraft_theta": (
        (
            {"th": "q", "al": "q-La*al-Ld*de", "q": "-Ma*al-Mq*q-Md*de"},
            ["de"],
            ["th"],
            {},
            {"La": 0.8, "Ld": 0.1, "Ma": 3, "Mq": 1, "Md": 5},
        ),
        1,
        "exponential",
    ),
    "cubic_zd": (({"x1": "x2+x1**2", "x2": "u", "x3": "-x3**3+x1"}, ["u"], ["x1"], {}, {}), 1, "asymptotic"),
    "cubic_zd_unst": (({"x1": "x2", "x2": "u+x3", "x3": "x3**3+x1"}, ["u"], ["x1"], {}, {}), 1, "unstable"),
    "square_zd": (({"x1": "u", "x2": "x2**2+x1"}, ["u"], ["x1"], {}, {}), 1, "unstable"),
    "cm_zd": (({"x1": "u", "x2": "x2*x3+x1", "x3": "-x3-x2**2"}, ["u"], ["x1"], {}, {}), 2, "asymptotic"),
    "cm_zd_unst": (({"x1": "u", "x2": "x2*x3+x1", "x3": "-x3+x2**2"}, ["u"], ["x1"], {}, {}), 2, "unstable"),
    "isidori_cm": (
        ({"x1": "x2", "x2": "x3+u", "x3": "x3*x4+x1", "x4": "-x4+a*x3**2"}, ["u"], ["x1"], {}, {"a": -2}),
        2,
        "asymptotic",
    ),
    "pend_zd_hang": (({"x1": "u", "q": "w+x1", "w": "-sin(q)+x1"}, ["u"], ["x1"], {}, {}), 2, "marginal"),
    "pend_zd_up": (({"x1": "u", "q": "w+x1", "w": "sin(q)"}, ["u"], ["x1"], {}, {}), 2, "unstable"),
    "lv_zd": (
        ({"x1": "u+x1*x2", "x2": "x2*(1-x3)+x1", "x3": "x3*(x2-1)"}, ["u"], ["x1"], {"x2": 1, "x3": 1}, {}),
        2,
        "marginal",
    ),
    "hopf_s": (({"x1": "u", "x2": "x3+x1", "x3": "-x2-x3**3"}, ["u"], ["x1"], {}, {}), 2, "asymptotic"),
    "hopf_u": (({"x1": "u", "x2": "x3", "x3": "-x2+x3**3+x1"}, ["u"], ["x1"], {}, {}), 2, "unstable"),
    "dint_zd": (({"x1": "u", "x2": "x3", "x3": "x1"}, ["u"], ["x1"], {}, {}), 2, "unstable"),
    "mimo22": (
        ({"x1": "x2+u1", "x2": "x3+x1*x3", "x3": "u2-x3", "x4": "-x4+x1*x2"}, ["u1", "u2"], ["x1", "x2"], {}, {}),
        1,
        "exponential",
    ),
    "mimo22_int": (
        (
            {"x1": "u1+x3", "x2": "u1*x1+u2", "x3": "-x3+x1*x2+x4", "x4": "-2*x4+x3**2+x2"},
            ["u1", "u2"],
            ["x1", "x2"],
            {},
            {},
        ),
        2,
        "exponential",
    ),
    "mimo33": (
        (
            {"x1": "u1", "x2": "u2+x4", "x3": "u3*(1+x1**2)", "x4": "x5", "x5": "-x4-x5+x1*x2"},
            ["u1", "u2", "u3"],
            ["x1", "x2", "x3"],
            {},
            {},
        ),
        2,
        "exponential",
    ),
    "mimo_sing": (
        ({"x1": "u1", "x2": "x3+u1", "x3": "u2-x4", "x4": "-x4**3+x1"}, ["u1", "u2"], ["x1", "x2"], {}, {}),
        1,
        "asymptotic",
    ),
    "quadrotor_planar": (
        (
            {"x": "vx", "vx": "-sin(t)*F", "z": "vz", "vz": "cos(t)*F-g", "t": "w", "w": "M/J"},
            ["F", "M"],
            ["x", "z"],
            {},
            {"g": 9.81, "J": 0.01},
        ),
        0,
        "exponential",
    ),
    "quadrotor_planar_zt": (
        (
            {"x": "vx", "vx": "-sin(t)*F", "z": "vz", "vz": "cos(t)*F-g", "t": "w", "w": "M/J"},
            ["F", "M"],
            ["z", "t"],
            {},
            {"g": 9.81, "J": 0.01},
        ),
        2,
        "unstable",
    ),
    "motor": (
        (
            {"w": "(K*i-B*w)/J", "i": "(-R*i-K*w+u)/L"},
            ["u"],
            ["i"],
            {},
            {"K": 0.1, "B": 0.01, "J": 0.1, "R": 1, "L": 0.1},
        ),
        1,
        "exponential",
    ),
    "induction_like": (
        ({"id": "-id+w*iq+u1", "iq": "-iq-w*id-w+u2", "w": "iq-0.1*w"}, ["u1", "u2"], ["id", "w"], {}, {}),
        0,
        "exponential",
    ),
    "furuta": (
        (
            {"q1": "p1", "q2": "p2", "p1": "u", "p2": "a*sin(q2)-b*u*cos(q2)+p1**2*sin(q2)*cos(q2)"},
            ["u"],
            ["q1"],
            {},
            {"a": 20, "b": 1},
        ),
        2,
        "unstable",
    ),
    "pendubot": (
        (
            {"q1": "p1", "q2": "p2", "p1": "u", "p2": "-G*sin(q1+q2)-u*(1+cos(q2))-sin(q2)*p1**2"},
            ["u"],
            ["q1"],
            {},
            {"G": 9.81},
        ),
        2,
        "marginal",
    ),
    "reaction_wheel": (
        ({"q": "w", "w": "a*sin(q)-b*u", "r": "c*u"}, ["u"], ["q"], {}, {"a": 10, "b": 1, "c": 5}),
        1,
        "marginal",
    ),
    "tanks": (
        ({"h1": "-sqrt(h1)+u", "h2": "sqrt(h1)-sqrt(h2)"}, ["u"], ["h1"], {"h1": 1, "h2": 1}, {}),
        1,
        "exponential",
    ),
    "tanks2": (
        ({"h1": "-a*sqrt(h1)+u", "h2": "a*sqrt(h1)-a*sqrt(h2)"}, ["u"], ["h2"], {"h1": 4, "h2": 4}, {"a": 0.5}),
        0,
        "exponential",
    ),
    "four_tank_min": (
        (
            {
                "h1": "-a*sqrt(h1)+a*sqrt(h3)+0.7*u1",
                "h2": "-a*sqrt(h2)+a*sqrt(h4)+0.6*u2",
                "h3": "-a*sqrt(h3)+0.4*u2",
                "h4": "-a*sqrt(h4)+0.3*u1",
            },
            ["u1", "u2"],
            ["h1", "h2"],
            {"h1": 1, "h2": 1, "h3": "64/225", "h4": "1/25"},
            {"a": 1},
        ),
        2,
        "exponential",
    ),
    "missile": (
        ({"al": "q+cos(al)*(-al**3-2*al)*0.1+0.02*d", "q": "-5*al**3-10*al-30*d"}, ["d"], ["al"], {}, {}),
        1,
        "unstable",
    ),
    "boost": (
        (
            {"i": "(-(1-d)*v+E)/L", "v": "((1-d)*i-v/R)/C"},
            ["d"],
            ["v"],
            {"i": 2, "v": 2},
            {"E": 1, "L": 1, "R": 2, "C": 1},
        ),
        1,
        "unstable",
    ),
    "boost_i": (
        (
            {"i": "(-(1-d)*v+E)/L", "v": "((1-d)*i-v/R)/C"},
            ["d"],
            ["i"],
            {"i": 2, "v": 2},
            {"E": 1, "L": 1, "R": 2, "C": 1},
        ),
        1,
        "exponential",
    ),
    "maglev": (
        (
            {"x": "v", "v": "g-c*i**2/x**2", "i": "(-R*i+u)/L"},
            ["u"],
            ["x"],
            {"x": 1, "v": 0},
            {"g": 9.81, "c": 1, "R": 1, "L": 1},
        ),
        0,
        "exponential",
    ),
    "symbolic": (({"x1": "u+a*x2", "x2": "-b*x2+x1"}, ["u"], ["x1"], {}, {"a": None, "b": None}), 1, "undecided"),
    "kuka3": (
        (
            {"q1": "w1", "q2": "w2", "q3": "w3", "w1": "u1-sin(q1)", "w2": "u2+u1*cos(q1)", "w3": "u3-w1*w2"},
            ["u1", "u2", "u3"],
            ["q1", "q2", "q3"],
            {},
            {},
        ),
        0,
        "exponential",
    ),
    "redundant_out": (({"x1": "x2", "x2": "u"}, ["u"], ["x1+x2"], {}, {}), 1, "exponential"),
    "nonmin_lin": (({"x1": "x2", "x2": "u"}, ["u"], ["x1-x2"], {}, {}), 1, "unstable"),
    "quadr_out": (({"x1": "x2", "x2": "-x1+u", "x3": "-x3+x1"}, ["u"], ["x1+x2**2+x2"], {}, {}), 2, "exponential"),
    "expout": (({"x1": "x2", "x2": "u-x3", "x3": "-x3+x2"}, ["u"], ["exp(x1)-1+x2"], {}, {}), 2, "exponential"),
    "vtol_full": (
        (
            {
                "x": "vx",
                "vx": "-sin(t)*u1+e*cos(t)*u2",
                "y": "vy",
                "vy": "cos(t)*u1+e*sin(t)*u2-1",
                "t": "w",
                "w": "u2",
            },
            ["u1", "u2"],
            ["x", "y"],
            {},
            {"e": -0.3},
        ),
        2,
        "marginal",
    ),
}
