"""Loops of pages run by node."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from compilers import node

from ulna.page import LoopScript, json_text, runtime_script


def run_page(scripts: LoopScript | list[LoopScript], body: str, folder: Path) -> Any:
    """What the body returns, which may use `loops` (one for each script), `programs`, `facts` and the engine."""
    rows = scripts if isinstance(scripts, list) else [scripts]
    programs = ",\n".join(each.script for each in rows)
    facts = ",\n".join(json_text(each.facts) for each in rows)
    text = f"""{runtime_script()}
const programs = [{programs}];
const facts = [{facts}];
const loops = programs.map((program, k) => ulnaLoop(program, facts[k]));
const loop = loops[0];
const answer = (() => {{ {body} }})();
require("fs").writeFileSync(process.argv[2], JSON.stringify(answer === undefined ? null : answer));
"""
    script, answer = folder / "page.js", folder / "answer.json"
    script.write_text(text, encoding="utf-8")
    subprocess.run([str(node()), str(script), str(answer)], check=True, env={**os.environ})
    return json.loads(answer.read_text(encoding="utf-8"))
