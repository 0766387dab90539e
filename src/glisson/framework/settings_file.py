"""`case.toml`: settings from its table, and its text with comments that tell people what can be changed."""

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import MISSING, asdict, fields
from typing import Any

import tomlkit

from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.core.parameters import build_parameters, parameters_by_kind, range_phrase
from glisson.core.registry import technique_class
from glisson.framework.settings import (
    DEFAULT_TECHNIQUES,
    KINDS,
    SCHEMA,
    SECTIONS,
    Settings,
    TechniqueChoice,
)
from glisson.preoperative.model.attachments import (
    ATTACHMENT_KINDS,
    DEFAULT_ATTACHMENTS,
    Attachment,
)
from glisson.preoperative.model.ligaments import LIGAMENTS
from glisson.preoperative.model.material_presets import HUMAN_LIVER, PRESETS
from glisson.preoperative.model.refinements import REFINEMENT_KINDS, Refinement
from glisson.preoperative.model.regions import ORGAN

_HEAD = """\
# A Glisson case; docs/case-folder.md says more. Lengths in mm, stresses in kPa, densities in kg/m³, points LPS.
# A line that begins with "#" shows a default: take the "#" away to change the value.
schema = {schema}
# The seed of every random number.
seed = {seed}
# The tumour to remove, by the name of its label; without it the largest one.
{target}
"""

_ABOUT = {
    "segment": "The liver from the scan: 'labels' takes a label map that was given, 'seeded-contour' a click or none.",
    "surface": "The closed surface of the liver's mask.",
    "mesh": "The tetrahedra inside the surface.",
    "simulate": "The solver of the manoeuvre that scenario.toml describes.",
    "vessels": "Portal and hepatic veins inside the liver, found in a scan with contrast agent (glisson vessels).",
    "capsule": "Glisson's capsule around the organ; materials of the regions inside it are further down.",
    "rod": "The wire or stent in the duct as an elastic rod, held at the duct's mouth.",
    "plane": "The resection plane; the side of the target is removed.",
    "scenario": "The manoeuvre that is proposed where nobody wrote or changed scenario.toml.",
}


def settings_from_table(table: Mapping[str, Any], where: str) -> Settings:
    """Settings of a `case.toml` that was parsed; `where` is its path for the sentences.

    Raises:
        BadInput: an unknown key (named with its path), a wrong type, or a value out of range. Technique
            parameters are checked when the technique is made, since that may load a plug-in.
    """
    sections = sorted({*KINDS, *SECTIONS, "materials"})
    known = ["schema", "seed", "target", *sections, "attachments", "refinements"]
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise BadInput(f"{where} does not know {unknown}; it has {known}.")
    seed = table.get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise BadInput(f"{where}: seed must be a whole number of at least 0, not {seed!r}.")
    target = table.get("target")
    if not isinstance(target, str | None):
        raise BadInput(f"{where}: target must be the name of a tumour, not {target!r}.")
    given = {name: _subtable(table, name, where) for name in sections}
    choices = {name: _choice(name, given[name], where) for name in KINDS}
    own = {name: _own_section(name, given[name], where) for name in SECTIONS}
    materials, attachments = _materials(given["materials"], where), _attachments(table, where)
    refinements = _refinements(table, where)
    return Settings(choices, materials, attachments, refinements, target=target, seed=seed, **own)


def settings_table(settings: Settings) -> dict[str, Any]:
    """The settings as plain TOML values, without those that are defaults."""
    table: dict[str, Any] = {"schema": SCHEMA, "seed": settings.seed}
    if settings.target is not None:
        table["target"] = settings.target
    for name in _ordered_sections():
        section = _technique_values(settings, name)
        if name in SECTIONS:
            section |= {key: value for key, value, default in _own_values(settings, name) if value != default}
        if section:
            table[name] = section
    table["materials"] = {name: asdict(material) for name, material in settings.materials.items()}
    table["attachments"] = _kind_tables(settings.attachments, ATTACHMENT_KINDS)
    if settings.refinements:
        table["refinements"] = _kind_tables(settings.refinements, REFINEMENT_KINDS)
    return table


def settings_text(settings: Settings, previous: str | None = None) -> str:
    """Text of `case.toml`: `previous` with what changed put in, or a new one in which all is explained."""
    if previous is None:
        sections = [_section_text(settings, name) for name in _ordered_sections()]
        target = "# target =" if settings.target is None else _assignment("target", settings.target)
        head = _HEAD.format(schema=SCHEMA, seed=settings.seed, target=target)
        held = [_materials_text(settings), _attachments_text(settings), _refinements_text(settings)]
        return "\n".join([head, *sections, *held])
    document = tomlkit.parse(previous)
    _update(document, settings_table(settings_from_table(document.unwrap(), "case.toml")), settings_table(settings))
    return tomlkit.dumps(document)


def _ordered_sections() -> list[str]:
    return [*KINDS, *(name for name in SECTIONS if name not in KINDS)]


def _subtable(table: Mapping[str, Any], name: str, where: str) -> Mapping[str, Any]:
    section = table.get(name, {})
    if not isinstance(section, Mapping):
        raise BadInput(f"{where}: {name} must be a table, written [{name}].")
    return section


def _choice(name: str, given: Mapping[str, Any], where: str) -> TechniqueChoice:
    technique = given.get("technique", DEFAULT_TECHNIQUES[name])
    if not isinstance(technique, str):
        raise BadInput(f"{where}: {name}.technique must be the name of a technique, not {technique!r}.")
    own = {field.name for field in fields(SECTIONS[name])} if name in SECTIONS else set()
    return TechniqueChoice(
        name, technique, {key: value for key, value in given.items() if key not in own and key != "technique"}
    )


def _own_section(name: str, given: Mapping[str, Any], where: str) -> Any:
    kind = SECTIONS[name]
    known = {field.name for field in fields(kind)}
    # In a section with a technique the other keys are the technique's.
    values = {key: value for key, value in given.items() if key in known} if name in KINDS else given
    return build_parameters(kind, values, f"{where}: {name}")


def _materials(given: Mapping[str, Any], where: str) -> dict[str, Material]:
    materials = {}
    for region, values in given.items():
        path = f"{where}: materials.{region}"
        if not isinstance(values, Mapping):
            raise BadInput(f"{path} must be a table, written [materials.{region}].")
        try:
            materials[region] = build_parameters(Material, _on_preset(values, path), path)
        except BadInput as error:
            sentence = str(error)
            raise BadInput(sentence if sentence.startswith(path) else f"{path}: {sentence}") from None
    return {ORGAN: HUMAN_LIVER} | materials


def _on_preset(values: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The values of a material on top of those of its preset, or of human liver."""
    name = values.get("preset", "human-liver")
    if not isinstance(name, str) or name not in PRESETS:
        raise BadInput(f"{where}: preset must be one of {sorted(PRESETS)}, not {name!r}.")
    return {**asdict(PRESETS[name].material), **{key: value for key, value in values.items() if key != "preset"}}


def _tables(table: Mapping[str, Any], name: str, where: str) -> list[Mapping[str, Any]]:
    given = table.get(name, [])
    if not isinstance(given, list) or not all(isinstance(entry, Mapping) for entry in given):
        raise BadInput(f"{where}: {name} must be a list of tables, each written [[{name}]].")
    return given


def _attachments(table: Mapping[str, Any], where: str) -> tuple[Attachment, ...]:
    given = _tables(table, "attachments", where)
    if "attachments" not in table:
        return DEFAULT_ATTACHMENTS
    return parameters_by_kind(ATTACHMENT_KINDS, given, "direction", f"{where}: attachments")


def _refinements(table: Mapping[str, Any], where: str) -> tuple[Refinement, ...]:
    given = _tables(table, "refinements", where)
    return parameters_by_kind(REFINEMENT_KINDS, given, "tumours", f"{where}: refinements")


def _kind_tables(entries: Sequence[Any], kinds: Mapping[str, type[Any]]) -> list[dict[str, Any]]:
    return [
        {"kind": next(kind for kind, made in kinds.items() if isinstance(entry, made))}
        | {key: _plain(value) for key, value in asdict(entry).items() if value is not None}
        for entry in entries
    ]


def _technique_values(settings: Settings, name: str) -> dict[str, Any]:
    if name not in KINDS:
        return {}
    choice = settings.choices[name]
    return {"technique": choice.technique, **_plain(choice.parameters)}


def _own_values(settings: Settings, name: str) -> list[tuple[str, Any, Any]]:
    section = getattr(settings, name)
    return [(field.name, _plain(getattr(section, field.name)), _plain(field.default)) for field in fields(section)]


def _section_text(settings: Settings, name: str) -> str:
    lines = [f"[{name}]", f"# {_ABOUT[name]}"]
    if name in KINDS:
        choice = settings.choices[name]
        lines.append(_assignment("technique", choice.technique))
        for field in fields(technique_class(choice.kind, choice.technique).Parameters):
            set_here = field.name in choice.parameters
            value = _plain(choice.parameters[field.name] if set_here else field.default)
            lines += _explained(field.name, value, field.metadata, set_here)
    if name in SECTIONS:
        explained = {field.name: field.metadata for field in fields(SECTIONS[name])}
        for key, value, default in _own_values(settings, name):
            lines += _explained(key, value, explained[key], value != default)
    return "\n".join(lines) + "\n"


def _explained(name: str, value: Any, about: Mapping[str, Any], is_set: bool) -> list[str]:
    low, high = about.get("minimum"), about.get("maximum")
    limits = f" Must {range_phrase(low, high)}." if low is not None or high is not None else ""
    choices = f" One of {', '.join(about['choices'])}." if about.get("choices") else ""
    lines = [f"# {about['help'].rstrip('.')}.{limits}{choices}"] if "help" in about else []
    if is_set:
        return [*lines, _assignment(name, value)]
    if value is None or value is MISSING or value == []:
        return [*lines, f"# {name} ="]
    return [*lines, f"# {_assignment(name, value)}"]


def _materials_text(settings: Settings) -> str:
    presets = "".join(f'# preset = "{name}": {preset.source}.\n' for name, preset in PRESETS.items())
    about = (
        "# Young's modulus above 0, Poisson's ratio below 0.5; laws: glisson techniques. A table may begin with a\n"
        f"# preset, on which its other values are put:\n{presets}"
    )
    return about + "\n".join(_material_text(region, material) for region, material in settings.materials.items())


def _material_text(region: str, material: Material) -> str:
    """A material by its preset with the values as a comment, or in full where it is none."""
    header, values = f"[materials.{tomlkit.key(region).as_string()}]", asdict(material)
    preset = next((name for name, preset in PRESETS.items() if preset.material == material), None)
    if preset is None:
        return _table_text(header, values)
    its_own = [f"# {_assignment(name, value)}" for name, value in values.items()]
    return "\n".join([header, _assignment("preset", preset), *its_own]) + "\n"


def _attachments_text(settings: Settings) -> str:
    about = (
        "# What holds the organ: surface nodes furthest along some directions (left, right, posterior, anterior,\n"
        '# superior, inferior), those in a box: kind = "box", low_mm = [x, y, z], high_mm = [x, y, z], or a ligament\n'
        f'# where the shape suggests it: kind = "ligament", name = one of {", ".join(LIGAMENTS)}.\n'
        "# Held fast, unless stiffness_kpa_mm says with what pull per area and displacement a ligament gives way.\n"
    )
    tables = [_table_text("[[attachments]]", table) for table in _kind_tables(settings.attachments, ATTACHMENT_KINDS)]
    return about + "\n".join(tables)


def _refinements_text(settings: Settings) -> str:
    about = (
        "# Where tetrahedra are to be smaller: [[refinements]] with edge_length_mm, about the tumours (reach_mm from\n"
        '# their surface), or in a ball, under a tool: kind = "ball", centre_mm = [x, y, z], radius_mm.\n'
    )
    tables = [_table_text("[[refinements]]", table) for table in _kind_tables(settings.refinements, REFINEMENT_KINDS)]
    return about + "\n".join(tables)


def _table_text(header: str, values: Mapping[str, Any]) -> str:
    return "\n".join([header, *(_assignment(name, value) for name, value in values.items())]) + "\n"


def _assignment(name: str, value: Any) -> str:
    return f"{name} = {tomlkit.item(_plain(value)).as_string()}"


def _plain(value: Any) -> Any:
    """Tuples as lists, mappings as dicts: what TOML and JSON know."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, (list, tuple)) else value


def _update(document: MutableMapping[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Put what changed from `before` to `after` into a document; its comments and layout stay."""
    for key in set(before) - set(after):
        document.pop(key, None)
    for key, value in after.items():
        if isinstance(value, Mapping) and isinstance(document.get(key), MutableMapping):
            _update(document[key], before.get(key, {}), value)
        elif key not in before or before[key] != value:
            document[key] = value
