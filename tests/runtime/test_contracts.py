"""What comes in from outside is what its type says, or a fault that says who gave what."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable
from unittest.mock import Mock

import numpy as np
import pytest
from specc_runtime import contracts as c
from specc_runtime.builtins import finite, near, near_pose, norm, pose, translation
from specc_runtime.contracts import Unfit
from specc_runtime.cycle import Executor
from specc_runtime.faults import DeviceFailed
from specc_runtime.loading import load_system
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.sampling import Sensor
from specc_runtime.system import System

from specc.pipeline import build
from tests.runtime import boundary
from tests.runtime.boundary import Grip, Plant, usual

SPEC = Path(__file__).parent / "boundary.yaml"
EYE = np.eye(4)
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
STRETCHED = np.diag([1.0, 1.01, 1.0, 1.0])


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package of the specification beside this file."""
    folder = tmp_path_factory.mktemp("boundary") / "boundary"
    files = build(str(SPEC)).files
    assert files
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return folder


@pytest.fixture
def given() -> Iterator[dict[str, Any]]:
    boundary.GIVEN.update(usual())
    yield boundary.GIVEN
    boundary.GIVEN.clear()


def run(package: Path, ticks: int = 3) -> tuple[System, Executor]:
    system = load_system(package, SPEC.parent)
    executor = Executor(system, Plant(), inline=True)
    for _ in range(ticks):
        if not executor.advance():
            break
    executor.finish()
    return system, executor


WRONG: list[tuple[str, Any, str]] = [
    ("side", "port", "operator SIDE gave the text 'port'"),
    ("side", 0, "operator SIDE gave the int 0"),
    ("side", ["PORT"], "operator SIDE gave a list of 1"),
    ("point", np.zeros(2), "operator POINT gave an array (2,) of float64"),
    ("point", np.zeros((3, 1)), "operator POINT gave an array (3, 1)"),
    ("point", [0.0, 0.0, 0.0], "operator POINT gave a list of 3"),
    ("point", np.array([0.0, math.nan, 0.0]), "operator POINT gave an array with nan at 1"),
    ("point", np.array([0.0, 0.0, -math.inf]), "operator POINT gave an array with -inf at 2"),
    ("point", np.array([True, False, True]), "operator POINT gave an array (3,) of bool"),
    ("point", np.array(["a", "b", "c"]), "operator POINT gave an array (3,) of <U1"),
    ("point", np.array([1j, 0, 0]), "operator POINT gave an array (3,) of complex128"),
    ("point", None, "operator POINT gave None"),
    ("length", "abc", "operator LENGTH gave the text 'abc'"),
    ("length", math.nan, "operator LENGTH gave the float nan"),
    ("length", -math.inf, "operator LENGTH gave the float -inf"),
    ("length", np.float64(math.inf), "operator LENGTH gave a value of class float64"),
    ("length", True, "operator LENGTH gave True"),
    ("length", 10**400, "operator LENGTH gave an int beyond all floats"),
    ("length", Decimal(1), "operator LENGTH gave a value of class Decimal"),
    ("length", np.zeros(1), "operator LENGTH gave an array (1,)"),
    ("count", 3.0, "operator COUNT gave the float 3.0"),
    ("count", True, "operator COUNT gave True"),
    ("ready", 1, "operator READY gave the int 1"),
    ("label", b"box", "operator LABEL gave a value of class bytes"),
    ("label", "\ud800", "operator LABEL gave a text with lone surrogates"),
    ("pose", np.zeros((4, 4)), "operator POSE gave an array whose last row is"),
    ("pose", MIRROR, "operator POSE gave an array (4, 4) that holds no rotation"),
    ("pose", STRETCHED, "operator POSE gave an array (4, 4) that holds no rotation"),
    ("pose", np.eye(3), "operator POSE gave an array (3, 3)"),
    ("force", np.zeros(3), "operator FORCE gave an array (3,)"),
    ("sides", ("PORT",), "operator SIDES gave a tuple of 1"),
    ("sides", ("PORT", "LEFT"), "operator SIDES gave the text 'LEFT' as [1]"),
    ("lengths", [0.1], "operator LENGTHS gave a list of 1"),
    ("lengths", (0.1, "b"), "operator LENGTHS gave the text 'b' as [1]"),
    ("some", (), "operator SOME gave a tuple of 0"),
    ("maybe", "none", "operator MAYBE gave the text 'none'"),
    ("grip", (0.1, EYE, ()), "operator GRIP gave a tuple of 3"),
    ("grip", Grip(math.nan, EYE, ("PORT",) * 2), "operator GRIP gave the float nan as .width"),
    (
        "grip",
        Grip(0.1, np.eye(3), ("PORT",) * 2),
        "operator GRIP gave an array (3, 3) of float64 as .X",
    ),
    ("grip", Grip(0.1, EYE, ("PORT", 1)), "operator GRIP gave the int 1 as .sides[1]"),
    ("token", object(), "operator TOKEN gave a value of class object"),
    ("colours", np.zeros((2, 3, 3)), "operator COLOURS gave an array (2, 3, 3) of float64"),
    ("colours", np.zeros((3, 2, 3), np.uint8), "operator COLOURS gave an array (3, 2, 3)"),
    ("a.E.m.q", np.zeros(3), "device a.E.m.q gave an array (3,)"),
    ("a.E.m.q", (0.0, 0.0), "device a.E.m.q gave a tuple of 2"),
    ("a.E.m.n", 0.5, "device a.E.m.n gave the float 0.5"),
    ("a.E.m.I", np.full((2, 3), math.nan), "device a.E.m.I gave an array with nan at (0, 0)"),
    ("a.E.m.X", MIRROR, "device a.E.m.X gave an array (4, 4) that holds no rotation"),
]
"""Who gives what, and what the fault says of it."""


@pytest.mark.parametrize(("name", "value", "said"), WRONG)
def test_a_wrong_value_is_a_fault_that_names_its_origin(
    package: Path, given: dict[str, Any], name: str, value: Any, said: str
) -> None:
    given[name] = value
    _, executor = run(package)
    (fault,) = executor.faults
    assert said in str(fault)
    assert " is declared" in str(fault)
    assert ": give " in str(fault)
    assert fault.culprit == said.partition(" gave ")[0]
    if "." not in name:
        number = 1 + list(usual()).index(name)
        number = {"grip": 13, "token": 14, "colours": 16}.get(name, number)
        assert f"eq. {number}:" in str(fault)


@pytest.mark.parametrize("value", [math.nan, "heavy", None])
def test_a_constant_that_an_operator_computes_is_checked_too(
    package: Path, given: dict[str, Any], value: Any
) -> None:
    given["weight"] = value
    with pytest.raises(Exception, match=r"operator WEIGHT gave .* real\[N\] is declared, eq. 15"):
        run(package)


def test_numbers_of_numpy_become_those_of_python(package: Path, given: dict[str, Any]) -> None:
    given |= {"count": np.uint8(200), "length": np.float32(0.5), "ready": np.bool_(True)}
    given |= {"label": np.str_("box"), "a.E.m.n": np.uint8(100), "some": (np.int8(1),)}
    given |= {"side": np.str_("PORT"), "lengths": (1, np.float64(2.0)), "maybe": np.float16(0.5)}
    system, executor = run(package)
    assert not executor.faults
    memory = system.scheduled("a.m").subsystem.memory
    assert memory.count == 300
    for name, kind in {"count": int, "length": float, "ready": bool, "label": str}.items():
        assert type(getattr(memory, name)) is kind
    assert [type(v) for v in (memory.side, memory.maybe, *memory.some)] == [str, float, int]
    assert memory.lengths == (1.0, 2.0) and all(type(v) is float for v in memory.lengths)


def test_arrays_are_read_only_and_nobody_elses(package: Path, given: dict[str, Any]) -> None:
    system, executor = run(package)
    assert not executor.faults
    m, c = system.scheduled("a.m").subsystem, system.scheduled("a.c").subsystem
    kept = {
        "point": m.memory.point, "pose": m.memory.held, "force": m.memory.force,
        "colours": m.memory.colours, "a.E.m.q": m.x.E_q, "a.E.m.I": m.memory.depth,
    }  # fmt: skip
    for name, array in [*kept.items(), ("grip", c.x.m_grip.X)]:
        source = given[name].X if name == "grip" else given[name]
        before = array.copy()
        source.flags.writeable = True
        source += 1
        assert np.array_equal(array, before), name
        with pytest.raises(ValueError, match="read-only"):
            array += 1


def test_whole_numbers_serve_as_real_vectors_and_floats_of_other_sizes_too() -> None:
    for values in (np.array([1, 2, 3]), np.array([1, 2, 3], np.float32)):
        assert c.as_vector(3)(values).dtype == np.float64
    assert c.as_depth(1, 1)(np.ones((1, 1))).dtype == np.float32


def test_the_largest_floats_are_numbers() -> None:
    largest = np.full(6, 1.7e308)
    assert np.array_equal(c.as_vector(6)(largest), largest)
    assert np.array_equal(finite(largest.copy()), largest)
    far = EYE.copy()
    far[:3, 3] = 1.7e308
    assert np.array_equal(c.as_pose(far), far)
    rounded = far + np.array([[0.0]] * 3 + [[1e-10]])
    assert np.array_equal(c.as_pose(rounded)[3], (0, 0, 0, 1))
    assert not c.as_pose(rounded).flags.writeable
    with pytest.raises(Unfit, match="last row"):
        c.as_pose(far + np.array([[0.0]] * 3 + [[1e-8]]))


def test_a_partial_vector_may_lack_components_and_holds_no_infinity() -> None:
    partial = c.as_partial(3)(np.array([1.0, math.nan, 3.0]))
    assert math.isnan(partial[1]) and not partial.flags.writeable
    with pytest.raises(Unfit):
        c.as_partial(3)(np.array([1.0, math.inf, 3.0]))


class Pair(NamedTuple):
    a: float
    b: str


class Loose:
    a = 0.0


class Same(Pair):
    """A class that only inherits."""


@dataclass(frozen=True)
class Width:
    a: float


class Inherits(Width):
    """A class that only inherits."""


def test_classes_of_records_keep_their_values() -> None:
    accept = c.as_record(Pair, a=c.as_real, b=c.as_text)
    assert accept(Pair(np.float64(1.0), "b")) == Pair(1.0, "b")
    with pytest.raises(TypeError, match="frozen dataclass or a NamedTuple"):
        c.as_record(Loose, a=c.as_real)
    with pytest.raises(TypeError, match="no field c"):
        c.as_record(Pair, a=c.as_real, b=c.as_text, c=c.as_real)
    with pytest.raises(TypeError, match=r"class Pair has fields .* not declare: b;"):
        c.as_record(Pair, a=c.as_real)


def test_a_class_that_inherits_from_one_of_a_record_is_one() -> None:
    assert c.as_record(Inherits, a=c.as_real)(Inherits(1.0)) == Inherits(1.0)
    made = c.as_record(Same, a=c.as_real, b=c.as_text)(Same(1.0, "b"))
    assert type(made) is Same and made == Same(1.0, "b")


def test_through_is_named_where_it_computes_the_sample() -> None:
    def halved(raw: Any) -> Any:
        return "half"

    binding = SensorBinding("a.E.m.q", through=halved, contract=c.as_real, declared="real[rad]")
    said = r"^device a.E.m.q, through .*:.*halved gave the text 'half'"
    with pytest.raises(DeviceFailed, match=said):
        Sensor(binding, lambda name: halved(None)).update(0.0)
    plain = replace(binding, through=None)
    with pytest.raises(DeviceFailed, match=r"^device a.E.m.q gave"):
        Sensor(plain, lambda name: None).update(0.0)


def test_no_code_of_a_foreign_class_is_executed_to_tell_of_it() -> None:
    class Trap:
        def __repr__(self) -> str:
            raise SystemExit

        __str__ = __len__ = __float__ = __eq__ = __repr__  # type: ignore[assignment]  # all traps
        __hash__ = None  # type: ignore[assignment]  # not even this

    for contract in (c.as_real, c.as_text, c.as_member("a"), c.as_vector(2), c.as_list(c.as_int)):
        with pytest.raises(Unfit, match="a value of class Trap"):
            contract(Trap())


def test_a_record_is_of_its_class_itself() -> None:
    class More(Width):
        b = 1.0

    with pytest.raises(Unfit, match="a value of class More"):
        c.as_record(Width, a=c.as_real)(More(1.0))


def test_an_opaque_type_is_a_class_that_values_can_be_tested_for() -> None:
    class Shown(Protocol):
        a: float

    for kind in (Shown, runtime_checkable(Shown), int | str, "Loose"):
        with pytest.raises(TypeError, match="cannot be the class of an opaque type"):
            c.as_instance(kind)  # type: ignore[arg-type]  # no classes


def _refuse(*_: object) -> Any:
    raise SystemExit


class _Int(int):
    __int__ = __index__ = __float__ = __eq__ = _refuse  # type: ignore[assignment]  # all traps
    __hash__ = _refuse


class _Numpy(np.int32):
    __int__ = __index__ = __float__ = item = _refuse


class _Float(float):
    __float__ = __eq__ = _refuse  # type: ignore[assignment]  # all traps
    __hash__ = _refuse


class _Text(str):
    __str__ = __eq__ = encode = _refuse  # type: ignore[assignment]  # all traps
    __hash__ = _refuse


class _Tuple(tuple[Any, ...]):
    __iter__ = __len__ = __getitem__ = _refuse  # type: ignore[assignment]  # all traps


def test_no_code_of_a_subclass_is_executed() -> None:
    cases: list[tuple[Any, Any, Any]] = [
        (c.as_int, _Int(3), 3),
        (c.as_int, _Numpy(3), 3),
        (c.as_real, _Int(3), 3.0),
        (c.as_real, _Numpy(3), 3.0),
        (c.as_real, _Float(0.5), 0.5),
        (c.as_text, _Text("a"), "a"),
        (c.as_member("a"), _Text("a"), "a"),
        (c.as_tuple(c.as_int, 2), _Tuple((1, 2)), (1, 2)),
        (c.as_list(c.as_int, least=1), _Tuple((1,)), (1,)),
    ]
    for contract, value, plain in cases:
        accepted = contract(value)
        assert accepted == plain and type(accepted) is type(plain)


@pytest.mark.parametrize("contract", [c.as_tuple(c.as_int, 2), c.as_list(c.as_int, least=1)])
def test_a_tuple_has_the_items_that_it_holds(contract: Any) -> None:
    class Two(tuple[Any, ...]):
        def __iter__(self) -> Iterator[Any]:
            return iter((1, 2))

        def __len__(self) -> int:
            return 2

    with pytest.raises(Unfit, match="a tuple of 0"):
        contract(Two())


@pytest.mark.parametrize("unit", ["ns", "s", "D"])
def test_durations_of_numpy_are_no_numbers(unit: str) -> None:
    for value in (np.timedelta64(5, unit), np.timedelta64("NaT", unit)):  # type: ignore[call-overload]  # any unit
        for contract in (c.as_int, c.as_real):
            with pytest.raises(Unfit, match="timedelta64"):
                contract(value)
    with pytest.raises(Unfit, match="timedelta64"):
        c.as_vector(1)(np.zeros(1, "m8[ns]"))


@pytest.mark.parametrize(
    ("contract", "kind"),
    [
        (c.as_bool, bool),
        (c.as_int, int),
        (c.as_real, float),
        (c.as_text, str),
        (c.as_member("a"), str),
        (c.as_list(c.as_int), tuple),
        (c.as_instance(Loose), Loose),
        (c.as_record(Width, a=c.as_real), Width),
    ],
)
def test_what_passes_for_another_class_is_not_of_it(contract: Any, kind: type) -> None:
    with pytest.raises(Unfit, match="a value of class"):
        contract(Mock(spec=kind))


def test_no_distance_is_negative() -> None:
    with pytest.raises(Unfit, match=r"an array with -1.0 at \(1, 0\)") as raised:
        c.as_depth(2, 2)(np.array([[1.0, 0.0], [-1.0, -2.0]]))
    assert raised.value.wanted == "metres, 0 where there is no reading"


@pytest.mark.parametrize("size", [1e200, 1e-200, 5e-324, 1.7e308])
def test_functions_of_the_language_give_numbers_for_any_numbers(size: float) -> None:
    assert norm(np.array([size, 0.0, -0.0])) == size
    far = translation(size, 0.0, 0.0)
    assert near_pose(far, far, 0.0, 0.0) is True
    assert near_pose(far, translation(-size, 0.0, 0.0), 0.5 * size, 1.0) is False
    assert near_pose(far, EYE, size, 0.0) is True
    assert near(np.array([size]), np.array([-size]), size) is False
    turned = pose(np.zeros(3), np.array([0.0, 0.0, size, size]))
    assert np.allclose(turned[:2, :2], [[0.0, -1.0], [1.0, 0.0]])


def test_arithmetic_that_overflows_is_no_number() -> None:
    for value in (math.inf, -math.inf, math.nan):
        with pytest.raises(OverflowError, match="not finite"):
            finite(value)
        with pytest.raises(OverflowError, match="not finite"):
            finite(np.array([0.0, value]))


def test_nobody_makes_what_crosses_writable_again() -> None:
    """A receiver that did would change what the sender has, and what is recorded of it."""
    image = np.zeros((2, 3, 3), np.uint8)
    for crossed in (
        c.as_vector(3)(np.ones(3)),
        c.as_vector(3)(np.ones(3, np.float32)),
        c.as_pose(EYE),
        c.as_rgb(2, 3)(image),
    ):
        with pytest.raises(ValueError, match="cannot set WRITEABLE"):
            crossed.setflags(write=True)
