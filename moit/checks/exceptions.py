"""What moit raises beyond Python's own TypeError, ValueError and OSError."""


class MoitError(Exception):
    """Base of every exception that only moit raises.

    >>> issubclass(moit.FragmentsError, moit.MoitError)
    True
    """


class FragmentsError(MoitError, ValueError):
    """Fragments that cannot be used; the message names the argument and the first bad index.

    >>> issubclass(moit.FragmentsError, ValueError)
    True
    """


class FragmentsTypeError(FragmentsError, TypeError):
    """Fragments of a wrong type: a TypeError, and caught with all other FragmentsErrors."""


class MeshError(MoitError, ValueError):
    """A mesh cannot be read, or its arrays do not make one.

    >>> issubclass(moit.MeshError, moit.MoitError)
    True
    """


class SplatsError(MoitError, ValueError):
    """Splats cannot be read, or their arrays do not make any.

    >>> issubclass(moit.SplatsError, moit.MoitError)
    True
    """


class PrimitiveError(MoitError, ValueError):
    """Arrays do not make points, lines or a volume.

    >>> issubclass(moit.PrimitiveError, moit.MoitError)
    True
    """


class TechniqueError(MoitError, ValueError):
    """A technique of one's own failed; the message names it and its function.

    >>> issubclass(moit.TechniqueError, ValueError)
    True
    """


class GpuError(MoitError, RuntimeError):
    """The GPU path cannot run; the message says what is missing and what to install.

    >>> issubclass(moit.GpuError, moit.MoitError)
    True
    """


def in_one_line(message: object) -> str:
    """What a foreign library says, or an error, without breaks of lines."""
    return " ".join(str(message).split())


def told(error: BaseException) -> str:
    """An error as a note: its type and the first line of what it says."""
    first = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}: {first}" if first else type(error).__name__
