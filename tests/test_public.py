"""What is public: all that `dir` shows and nothing else, and types that tools can read."""

import inspect
import types
import typing

import moit

MODULES = ("gpu", "gradients", "metrics", "moments", "plot", "scenes")


def public():
    """Every public name, with those of modules' contents and of classes' methods."""
    found = {}
    for name in dir(moit):
        if name == "__version__":
            continue
        one = getattr(moit, name)
        found[name] = one
        if isinstance(one, types.ModuleType):
            listed = getattr(one, "__all__", [n for n in vars(one) if not n.startswith("_")])
            for inner in listed:
                what = getattr(one, inner)
                module = getattr(what, "__module__", "")
                if module == one.__name__ or (hasattr(one, "__all__") and "moit" in module):
                    found[f"{name}.{inner}"] = what
    for name, one in list(found.items()):
        if inspect.isclass(one):
            for inner, what in inspect.getmembers_static(one):
                what = what.fget if isinstance(what, property) else what
                what = getattr(what, "__func__", what)
                if not inner.startswith("_") and inspect.isfunction(what):
                    found[f"{name}.{inner}"] = what
    return {name: one for name, one in found.items() if not isinstance(one, types.ModuleType)}


def test_dir_has_what_is_public_only():
    assert set(dir(moit)) == {*moit.__all__, "__version__"}
    for name in dir(moit):
        assert hasattr(moit, name)
    hidden = {"catalog", "checks", "core", "TYPE_CHECKING", "Any", "VERSION", "questions"}
    assert not hidden & set(dir(moit))


def test_type_hints_can_be_read():
    unread = {}
    for name, one in public().items():
        try:
            typing.get_type_hints(one) if callable(one) else None
        except (NameError, TypeError, AttributeError) as why:
            unread[name] = why
    assert not unread
