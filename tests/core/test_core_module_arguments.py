"""Arguments of modules against the annotations of their constructors."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np
import pytest

from webmap.base.errors import ConfigError
from webmap.core.extendable import Extendable
from webmap.core.module_arguments import WrongArguments, check_arguments
from webmap.core.registry import Namespace
from webmap.ros.bridge import Bridge


class Speaks(Protocol):
    def speak(self) -> None: ...


def made(annotation):
    def factory(owner, it="nothing"): ...

    factory.__annotations__["it"] = annotation
    return factory


def named(value):
    """Return the name of a value for test ids, the same in each process."""
    return str(value).partition(" object at")[0]


ACCEPTED = [
    (int, 3),
    (int, np.int32(3)),
    (float, 3),
    (float, np.float32(3)),
    (float, math.inf),
    (float, math.nan),
    (float | None, None),
    (bool, False),
    (str, ""),
    (str | Path, Path()),
    (Path, Path()),
    (tuple[float, float], [1, 2.5]),
    (tuple[float, ...], [1]),
    (list[str], ("a",)),
    (Iterable[int], iter([1])),
    (Iterable[int], np.arange(2)),
    (Mapping[str, int], {"a": 1}),
    (dict, {}),
    (list, []),
    (Literal["a", 2], 2),
    (Annotated[int, "of something"], 2),
    (Callable[[], None], len),
    (Bridge, object()),  # a fake, as in tests
    (Speaks, "anything"),
    (Any, object()),
    ("Robot | None", object()),
    ("not a type at all", 1),
]
REFUSED = [
    (int, "3", "a whole number"),
    (int, 3.0, "a whole number"),
    (int, True, "a whole number"),
    (float, "3", "a number"),
    (float, 10**400, "a number"),
    (float, object(), "a number"),
    (float | None, [], "a number"),
    (int | str, 1.5, "a whole number or a text"),
    (bool, 1, "true or false"),
    (str, 5, "a text"),
    (str, object(), "a text"),
    (str | Path, 3, "a text or a Path"),
    (tuple[float, float], [1], "2 in a list: a number, a number"),
    (tuple[float, float], 1, "2 in a list: a number, a number"),
    (list[str], "ab", "a list, each a text"),
    (list, "ab", "a list"),
    (Iterable[str], {"a": 1}, "a list, each a text"),
    (Mapping[str, int], [1], "a table"),
    (Literal["a", "b"], "c", '"a" or "b"'),
    (Callable[[], None], 3, "a Callable"),
    (Bridge, "hall", "a Bridge"),
    ("Robot | None", "Bob", "a Robot"),
    ("int", "3", "a whole number"),
]


@pytest.mark.parametrize(("annotation", "value"), ACCEPTED, ids=named)
def test_a_value_of_the_annotated_type_is_accepted(annotation, value):
    check_arguments(made(annotation), [value], {})
    check_arguments(made(annotation), [], {"it": value})


@pytest.mark.parametrize(("annotation", "value", "expected"), REFUSED, ids=named)
def test_a_value_of_another_type_is_refused(annotation, value, expected):
    with pytest.raises(WrongArguments) as error:
        check_arguments(made(annotation), [], {"it": value})
    (wrong,) = error.value.wrong
    assert (wrong.path, wrong.text) == (("options", "it"), expected)


def test_the_path_of_a_wrong_value_leads_into_lists_and_tables():
    kind = list[Mapping[str, tuple[int, int]]]
    with pytest.raises(WrongArguments) as error:
        check_arguments(made(kind), [[{}, {"a": [1, "2"]}]], {}, first=1)
    (wrong,) = error.value.wrong
    assert (wrong.path, wrong.got) == (("args", 1, 1, "a", 1), ("2",))
    assert "it[1]['a'][1]: expected a whole number, got '2'" in str(error.value)


def test_variable_positional_and_keyword_arguments_are_also_checked():
    def factory(owner, *many: int, **named: str): ...

    check_arguments(factory, [1, 2], {"a": "b"})
    with pytest.raises(WrongArguments, match=r"many: expected a whole.*a: expected"):
        check_arguments(factory, [1, "2"], {"a": 3})


def test_missing_unknown_and_extra_arguments_are_refused():
    def factory(owner, one, *, two=0): ...

    with pytest.raises(WrongArguments, match=r"missing .* 'one'; it takes \(one, two"):
        check_arguments(factory, [], {})
    with pytest.raises(WrongArguments, match="too many positional arguments"):
        check_arguments(factory, [1, 2], {})
    with pytest.raises(WrongArguments, match='no argument "tow"; did you mean "two"'):
        check_arguments(factory, [1], {"tow": 2})
    twice = '"one" has multiple values: one by its place, one by its name'
    with pytest.raises(WrongArguments, match=twice) as error:
        check_arguments(factory, [1], {"one": 2})
    assert error.value.wrong[0].path == ("options", "one")


def test_owner_is_refused_as_a_keyword_even_with_variable_keyword_arguments():
    def factory(owner, one=0, **others): ...

    pattern = r'no argument "owner"; .* takes \(one, \*\*others\)'
    with pytest.raises(WrongArguments, match=pattern):
        check_arguments(factory, [1], {"owner": 2})


def test_a_positional_only_name_is_free_for_variable_keyword_arguments():
    def factory(owner, one, /, **others): ...

    check_arguments(factory, [1], {"owner": 2, "one": 3})


def test_arguments_of_a_factory_without_a_signature_are_not_checked():
    check_arguments(dict, [1], {"a": 2})


def test_a_wrong_argument_is_refused_before_the_module_is_made():
    made = []

    class Lamp:
        def __init__(self, owner: object, *, watts: int = 5) -> None:
            made.append(self)

    owner = Extendable(Namespace("lamp"))
    for error in (ConfigError, TypeError):
        with pytest.raises(error, match="Lamp: watts: expected a whole number, got '9"):
            owner.add_module(Lamp, watts="9")
    assert made == owner.modules == []
    owner.add_module(Lamp, watts=9)
    assert owner.modules == made
