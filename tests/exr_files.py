"""OpenEXR files with headers that no library would write, made of ones that it wrote."""

import struct


def attributes(data):
    """(name, where the value begins, its length) of each attribute of a file's first header."""
    at = 8
    while data[at]:
        end = data.index(b"\0", at)
        begin = data.index(b"\0", end + 1) + 5
        length = struct.unpack_from("<i", data, begin - 4)[0]
        yield data[at:end], begin, length
        at = begin + length


def header_end(data):
    """Where the first header of a file ends: at its closing zero."""
    return max(begin + length for _, begin, length in attributes(data))


def packed(name, kind, value):
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value


def value_of(data, name):
    """Where the value of an attribute begins, and its length."""
    return next((begin, length) for own, begin, length in attributes(data) if own == name)


def with_attributes(data, *attributes):
    """The file of one part with more attributes (name, type, value) in its header."""
    end = header_end(data)
    more = b"".join(packed(*one) for one in attributes)
    at, _ = value_of(data, b"chunkCount")
    (chunks,) = struct.unpack_from("<i", data, at)
    table = struct.unpack_from(f"<{chunks}Q", data, end + 1)
    moved = struct.pack(f"<{chunks}Q", *(place + len(more) for place in table))
    return data[:end] + more + data[end : end + 1] + moved + data[end + 1 + 8 * chunks :]


def with_value(data, name, value):
    """The file with another value, as long, of an attribute."""
    at, length = value_of(data, name)
    assert length == len(value)
    return data[:at] + value + data[at + length :]
