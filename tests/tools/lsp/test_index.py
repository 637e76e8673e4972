"""Symbols: where they are defined and named, and what is said of them."""

from pathlib import Path

import pytest

from specc.schema.places import role_of
from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, opened, place

FLAGSHIP = str(ROOT / "specs/irp_picking.yaml")
# What is called differently where it is named: a device by its letter, `control` by c.
DIFFERENT = {"device", "subsystem"}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str, str]:
    return opened(tmp_path_factory.mktemp("workspace"))


@pytest.fixture(scope="module")
def flagship() -> Project:
    project = Project()
    project.analyse(FLAGSHIP)
    return project


def test_workspace_is_understood(workspace: tuple[Project, str, str]) -> None:
    found = features.notes(workspace[0])
    assert set(found) == set(workspace[1:])
    errors = [
        note.diagnostic.message
        for notes in found.values()
        for note in notes
        if note.diagnostic.severity == "error"
    ]
    assert errors == []


@pytest.mark.parametrize(
    ("at", "definition"),
    [
        ("y.E.q_d: |q_p, y.c", "|q_p: {type"),
        ("near(|q_p,", "|q_p: {type"),
        ("X_c: |T_c, grip", "|T_c: {is"),
        ("x.E.q_m, |limit", "|limit: {is"),
        ('is: "|DK(', "|DK: {signature"),
        ("grip.|width", "|width:"),
        ("in {|go}", "enum[|go,"),
        ("mode == |halt", ", |halt]"),
        ("functions: [|hold]", "|hold: {title"),
        ("terminal: |reached}", "|reached:"),
        ("S0: |idle,", "|idle: {f"),
        ("initial_state: |S0\n        transitions:\n", "|S0: idle"),
        ("when: always, to: |S0}", "|S0: idle"),
        ("going, |S1]", "|S1: motion"),
        ("terminal, |going", "|going:"),
        ("mode: |Mode}\n          E", "|Mode: {type"),
        ('X_c: "pose[|B, E]"}\n          E', "|B: base"),
        ("(q: |Joints)", "|Joints: vector"),
        ('pose[B, |E]", python', '|E: "end'),
        ("all(|v <", "for |v in q_p)"),
        ("for |v in", "for |v in q_p)"),
        ("use: lib/|fingers", None),
        ("all(v < |1[rad]", None),
    ],
)  # fmt: skip
def test_goes_to_the_definition(
    at: str, definition: str | None, workspace: tuple[Project, str, str]
) -> None:
    project, system, _ = workspace
    found = features.definition(project, system, place(SYSTEM, at))
    wanted = [] if definition is None else [place(SYSTEM, definition)]
    assert [stretch.start for stretch in found if stretch.path == system] == wanted


def test_goes_to_both_ends_of_a_connection(workspace: tuple[Project, str, str]) -> None:
    project, system, library = workspace
    found = features.definition(project, system, place(SYSTEM, "move: {y.E.q_d: x.c.|q_d"))
    sender, reader = place(SYSTEM, "y: {m: {|q_d"), place(SYSTEM, "c: {|q_d: {type")
    assert {stretch.start for stretch in found} == {sender, reader}
    found = features.definition(project, library, place(LIBRARY, "y.E.|d_d"))
    assert {stretch.path for stretch in found} == {system, library}


def test_goes_across_files(workspace: tuple[Project, str, str]) -> None:
    project, system, library = workspace
    (file,) = features.definition(project, system, place(SYSTEM, "use: lib/|fingers"))
    assert file.path == library
    (parameter,) = features.definition(project, system, place(SYSTEM, "with: {|tolerance"))
    assert (parameter.path, parameter.start) == (library, place(LIBRARY, "{|tolerance: "))


def test_finds_all_references(workspace: tuple[Project, str, str]) -> None:
    project, system, _ = workspace
    found = features.references(project, system, place(SYSTEM, "|q_p: {type"))
    assert len(found) == SYSTEM.count("q_p")
    uses = features.references(project, system, place(SYSTEM, "|q_p: {type"), declarations=False)
    assert len(uses) == len(found) - 1
    # The element q_d of irp.m and irp.c is not the one of the device.
    element = features.references(project, system, place(SYSTEM, "y: {m: {|q_d"))
    device = features.references(project, system, place(SYSTEM, "m: {x: {|q_d"))
    assert not set(element) & set(device)
    assert len(element) + len(device) == SYSTEM.count("q_d")


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ("grip.|width", ["field", "real[m]", "unit m"]),
        ("near(|q_p,", ["previous joints", "eq. 7", "vector[2, rad]", "unit rad"]),
        ("near|(q_p", ["bool"]),
        ('is: "|DK(', ["direct kinematics", "eq. 15", "pose[B, E]"]),
        ("X_c: |T_c, grip", ["pose[B, E]", "base of the arm", "end-effector 🦾", "eq. 24"]),
        ("< |0.1[m]", ["real[m]", "0.1"]),
        ("v < |1[rad]", ["real[rad]", "terminal condition `reached`"]),
        ("c: {|q_d: {type", ["desired joints", "from irp.c to irp.m"]),
        ("|S0: idle, S1", ["state", "idle"]),
        ("|rate: 10 Hz\n        x", ["Periods per second"]),
        ("enum[|go,", ["member", "go"]),
    ],
)  # fmt: skip
def test_says_what_it_is(at: str, words: list[str], workspace: tuple[Project, str, str]) -> None:
    project, system, _ = workspace
    found = features.hover(project, system, place(SYSTEM, at))
    assert found is not None
    assert [word for word in words if word not in found.text] == []
    assert found.range.start <= place(SYSTEM, at) <= found.range.end


def test_every_name_of_the_flagship_is_that_of_its_symbol(flagship: Project) -> None:
    view = flagship.view(FLAGSHIP)
    assert view is not None
    for source in view.index.sources:
        for occurrence in view.index.occurrences(source.path):
            if occurrence.symbol.kind not in DIFFERENT:
                named = source.text[occurrence.start : occurrence.end]
                assert named == occurrence.symbol.name, occurrence


def test_every_reference_of_the_flagship_leads_to_its_definition(flagship: Project) -> None:
    view = flagship.view(FLAGSHIP)
    assert view is not None
    for occurrence in view.index.occurrences(FLAGSHIP):
        places = {
            (s.path, s.start) for s in features.definition(flagship, FLAGSHIP, occurrence.start)
        }
        declared = {
            (end.place.file, view.index.offsets(end.place)[0])
            for end in occurrence.symbol.declarations
        }
        assert places == declared, occurrence


def test_every_name_in_the_structure_of_the_flagship_is_known(flagship: Project) -> None:
    """What the schema of names calls a name is one that the index leads somewhere."""
    view = flagship.view(FLAGSHIP)
    assert view is not None
    for source in view.index.sources:
        known = {(o.start, o.end) for o in view.index.occurrences(source.path)}
        assert source.spans is not None
        for route, _, node in source.nodes:
            role = role_of(route)
            words = ("always", "never", "otherwise", "terminal", "error")
            fixed = node.scalar in words
            if role and role.form in ("name", "task") and node.scalar and not fixed:
                # `irp.c` names an agent and a subsystem.
                assert node.start in {start for start, _ in known}, route
                assert node.end in {end for _, end in known}, route


def test_a_file_that_is_no_yaml_is_answered_from_before(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    broken = SYSTEM.replace("title: what is commanded}", 'title: "what is')
    project.put(system, broken)
    before = {note.diagnostic.code for note in features.notes(project)[system]}
    project.analyse(system)
    found = {note.diagnostic.code for note in features.notes(project)[system]}
    assert found == {"E0009"} | before
    at = place(broken, "X_c: |T_c, grip")
    (definition,) = features.definition(project, system, at)
    assert definition.start == place(broken, "|T_c: {is")
    hover = features.hover(project, system, at)
    assert hover is not None
    assert hover.range.start == at


def test_a_file_that_was_never_understood_still_has_names(tmp_path: Path) -> None:
    path = str(tmp_path / "arm.yaml")
    project = Project()
    wrong = SYSTEM.replace("rate: 10 Hz\n        x", "rats: 10 Hz\n        x")
    project.put(path, wrong)
    project.analyse(path)
    assert {note.diagnostic.code for note in features.notes(project)[path]} == {"E0101"}
    (definition,) = features.definition(project, path, place(wrong, "X_c: |T_c, grip"))
    assert definition.start == place(wrong, "|T_c: {is")


def test_unsaved_texts_are_used_instead_of_the_disk(tmp_path: Path) -> None:
    project, system, library = opened(tmp_path)
    project.put(library, LIBRARY.replace("{tolerance: ", "{width: "))
    assert project.find_roots(library) == [system]
    project.analyse(system)
    assert {n.diagnostic.code for n in features.notes(project)[system]} >= {"E0201"}
    project.close(library)
    project.analyse(system)
    assert "E0201" not in {n.diagnostic.code for n in features.notes(project)[system]}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[S0, terminal, going, S1]", "[S0, |terminal, going, S1]", "`always`"),
        ("cause: terminal, when", "cause: ter|minal, when", "behaviour `motion` of state `S1`"),
        ("      g: {use", "      # specc: ignore W0|901\n      g: {use", "W0901"),
    ],
)
def test_hover_explains_what_is_no_symbol(old: str, new: str, words: str, tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    before, after = SYSTEM.replace(old, new).split("|")
    project.put(system, before + after)
    project.analyse(system)
    hover = features.hover(project, system, len(before))
    assert hover is not None
    assert words in hover.text


def test_an_end_of_a_connection_is_told_once_for_all_copies() -> None:
    project = Project()
    project.analyse(str(ROOT / "specs/rovers.yaml"))
    shared = [
        symbol
        for analysis in project.analyses()
        for file in analysis.index.files.values()
        for symbol in file.by_route.values()
        if len(symbol.declarations) > 1
    ]
    assert shared
    for symbol in shared:
        names = [(each.place, each.qualified) for each in symbol.declarations]
        assert len(names) == len(set(names)), symbol.qualified
