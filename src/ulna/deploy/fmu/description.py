"""`modelDescription.xml` of FMI 2.0 and 3.0."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version as version_of
from xml.sax.saxutils import quoteattr

from ulna.deploy.fmu.part import Model, Variable

_MOST_PERIODS = 1000
"""Of the experiment that importers offer at first."""


def description(model: Model, version: int, token: str) -> str:
    """The XML: what an importer reads of an FMU."""
    head = {
        "fmiVersion": f"{version}.0",
        "modelName": model.name,
        "guid" if version == 2 else "instantiationToken": token,
        "description": f"{model.text}; design {model.fingerprint}",
        "generationTool": f"ulna {version_of('ulna')}",
        "variableNamingConvention": "flat",
    } | ({"numberOfEventIndicators": "0"} if version == 2 else {})
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<fmiModelDescription{_attributes(head)}>",
        *_co_simulation(model, version),
        *_units(model),
        f"  <DefaultExperiment{_attributes(_experiment(model))}/>",
        "  <ModelVariables>",
        *(_variable2(v, k) if version == 2 else _variable3(v, k) for k, v in enumerate(model.variables, 1)),
        "  </ModelVariables>",
        "  <ModelStructure>",
        *_structure(model, version),
        "  </ModelStructure>",
        "</fmiModelDescription>",
    ]
    if version == 3:
        time = '    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>'
        lines.insert(lines.index("  <ModelVariables>") + 1, time)
    return "\n".join(lines) + "\n"


def _attributes(values: Mapping[str, str]) -> str:
    return "".join(f" {name}={quoteattr(_plain(value))}" for name, value in values.items())


def _plain(text: str) -> str:
    """Without characters that XML does not have."""
    return "".join(c if c.isprintable() else " " for c in text)


def _experiment(model: Model) -> dict[str, str]:
    return {"startTime": "0", "stopTime": repr(_MOST_PERIODS * model.period), "stepSize": repr(model.period)}


def _co_simulation(model: Model, version: int) -> list[str]:
    values = {"modelIdentifier": model.identifier, "canHandleVariableCommunicationStepSize": "true"}
    if version == 3:
        values |= {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
        return [f"  <CoSimulation{_attributes(values)}/>"]
    values |= {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
    files = [f"      <File name={quoteattr(name)}/>" for name in ("model.c", "fmi2.c")]
    return [
        f"  <CoSimulation{_attributes(values)}>",
        "    <SourceFiles>",
        *files,
        "    </SourceFiles>",
        "  </CoSimulation>",
    ]


def _units(model: Model) -> list[str]:
    names = sorted({v.signal.unit for v in model.variables if v.signal.unit})
    if not names:
        return []
    return ["  <UnitDefinitions>", *(f"    <Unit{_attributes({'name': n})}/>" for n in names), "  </UnitDefinitions>"]


def _common(each: Variable, reference: int) -> dict[str, str]:
    values = {"name": each.name, "valueReference": str(reference)}
    if each.signal.text:
        values["description"] = each.signal.text
    values["causality"] = each.causality
    values["variability"] = "fixed" if each.causality == "parameter" else "continuous"
    if each.causality == "output":
        values["initial"] = "calculated"
    if each.causality in ("local", "parameter"):
        values["initial"] = "exact"
    return values


def _number(each: Variable) -> dict[str, str]:
    unit = {"unit": each.signal.unit} if each.signal.unit else {}
    return unit | ({} if each.causality == "output" else {"start": repr(float(each.start))})


def _variable2(each: Variable, reference: int) -> str:
    outer = _attributes(_common(each, reference))
    return f"    <ScalarVariable{outer}><Real{_attributes(_number(each))}/></ScalarVariable>"


def _variable3(each: Variable, reference: int) -> str:
    return f"    <Float64{_attributes(_common(each, reference) | _number(each))}/>"


def _structure(model: Model, version: int) -> list[str]:
    shown = [k for k, each in enumerate(model.variables, 1) if each.causality == "output"]
    if version == 3:
        rows = [f'    <Output valueReference="{k}"/>' for k in shown]
        return rows + [f'    <InitialUnknown valueReference="{k}"/>' for k in shown]
    unknowns = [f'      <Unknown index="{k}"/>' for k in shown]
    if not shown:
        return []
    return [
        "    <Outputs>", *unknowns, "    </Outputs>", "    <InitialUnknowns>", *unknowns, "    </InitialUnknowns>",
    ]  # fmt: skip


def build_description(model: Model) -> str:
    """`sources/buildDescription.xml` of FMI 3.0."""
    files = "".join(f"      <SourceFile name={quoteattr(name)}/>\n" for name in ("model.c", "fmi3.c"))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f"  <BuildConfiguration{_attributes({'modelIdentifier': model.identifier})}>\n"
        f'    <SourceFileSet language="C99">\n{files}    </SourceFileSet>\n'
        "  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
