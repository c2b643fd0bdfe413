"""Every public function of the engine says what it takes and what comes out."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from numpydoc.docscrape import NumpyDocString

ENGINE = Path(__file__).parent.parent / "workers"
MODULES = sorted(ENGINE.rglob("*.py"))
Function = ast.FunctionDef | ast.AsyncFunctionDef


def public_functions(node: ast.AST) -> Iterator[Function]:
    """Functions and methods whose names have no underscore in front, properties left out."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef) and not child.name.startswith("_"):
            yield from public_functions(child)
        if isinstance(child, Function) and not child.name.startswith("_"):
            decorators = {name.id for name in child.decorator_list if isinstance(name, ast.Name)}
            if not decorators & {"property", "cached_property", "overload"}:
                yield child


def arguments(function: Function) -> list[str]:
    """Names of what it takes, `self` and `cls` left out."""
    found = function.args
    every = [*found.posonlyargs, *found.args, found.vararg, *found.kwonlyargs, found.kwarg]
    names = [argument.arg.lstrip("_") for argument in every if argument is not None]
    return [name for name in names if name not in {"self", "cls", ""}]


def returns_something(function: Function) -> bool:
    """Whether it is annotated with anything but None or NoReturn."""
    annotation = ast.unparse(function.returns) if function.returns else "None"
    return annotation not in {"None", "NoReturn", "Never"}


def faults(function: Function) -> list[str]:
    """What its docstring lacks."""
    text = NumpyDocString(ast.get_docstring(function) or "")
    described = {
        name.strip().lstrip("*_"): " ".join(entry.desc).strip()
        for section in ("Parameters", "Other Parameters")
        for entry in text[section]
        for name in entry.name.split(",")
    }
    wanted = arguments(function)
    missing = [name for name in wanted if name not in described]
    bare = [name for name, words in described.items() if not words and name in wanted]
    unknown = [name for name in described if name not in wanted]
    found = [
        *(f"{name} is not among its parameters" for name in missing),
        *(f"{name} has no description" for name in bare),
        *(f"{name} is no argument" for name in unknown),
    ]
    if returns_something(function) and not (text["Returns"] or text["Yields"]):
        found.append("it has no Returns")
    return [f"{function.name}, line {function.lineno}: {fault}" for fault in found]


@pytest.mark.parametrize("module", MODULES, ids=lambda path: str(path.relative_to(ENGINE)))
def test_public_functions_name_what_they_take_and_return(module: Path) -> None:
    tree = ast.parse(module.read_text(encoding="utf-8"))
    assert [fault for one in public_functions(tree) for fault in faults(one)] == []
