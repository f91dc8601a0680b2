"""Rows of a deep file, a band at a time."""

from __future__ import annotations

import os
import tempfile

from moit.formats.deep_parts import ExrFile, Part
from moit.formats.deep_rows import DeepRows, stacked, uncompressed_rows
from moit.formats.exr_headers import HeaderError
from moit.system.files import lost
from moit.system.image_library import complaint, image_library
from moit.system.whole import is_whole

ROWS_AT_ONCE = 128


class Source:
    """Rows of a deep file. OpenImageIO decodes them and writes them to a file of their own without
    compression, which OpenEXR turns into arrays: it cannot read a part of a file, and the former
    cannot make arrays of samples."""

    def __init__(self, name: str, part: Part) -> None:
        self.name, self.part = name, part
        self.folder = tempfile.TemporaryDirectory(prefix="moit-")

    def __enter__(self) -> Source:
        try:
            return self._opened()
        except BaseException:
            self.folder.cleanup()
            raise

    def _opened(self) -> Source:
        oiio = image_library()
        try:
            name = self.name
            name.encode()
        except UnicodeEncodeError:
            raise OSError(f"{self.name!r}: OpenImageIO takes Unicode names only") from None
        file = oiio.ImageInput.open(name) if self.part.plain else None
        if file is None:
            complaint(oiio)
            file = oiio.ImageInput.open(self._copy())
        if file is None or not file.seek_subimage(self.part.index, 0):
            raise OSError(f"{self.name!r}: damaged: {complaint(oiio) or 'cannot be opened'}")
        self.file, self.spec = file, file.spec()
        window = (self.spec.x, self.spec.y), (self.spec.width, self.spec.height)
        if not self.spec.deep or window != (self.part.first, self.part.size):
            raise OSError(f"{self.name!r}: damaged: what its headers say contradicts itself")
        self.step = max(1, int(self.spec.tile_height))
        return self

    def _copy(self) -> str:
        """The file without attributes that its pixels do not need."""
        path = os.path.join(self.folder.name, "copy.exr")
        with open(self.name, "rb") as stream:
            ExrFile(self.name, stream).copy_to(path)
        return path

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self.folder.cleanup()

    def up(self, row: int) -> int:
        """The first row at or below `row` that a band may end before."""
        return -(-row // self.step) * self.step

    def rows(self, begin: int, end: int) -> DeepRows:
        """Rows begin to end - 1, counted from the first of the data window, with all channels."""
        path = self.file_of(begin, end)
        try:
            with open(path, "rb") as stream:
                found = uncompressed_rows(stream, os.path.getsize(path))
        except HeaderError as error:
            raise OSError(f"{self.name!r}: damaged, or beyond OpenImageIO: {error}") from None
        if set(found.channels) != set(self.part.readable):
            raise OSError(f"{self.name!r}: damaged: what its headers say contradicts itself")
        own = zip(self.part.channels, self.part.readable, strict=True)
        return found.with_channels({name: found.channels[key] for name, key in own})

    def all_rows(self) -> DeepRows:
        """All rows, decoded some at a time: what is held twice on the way is a part of them."""
        height, found = self.part.size[1], []
        for begin in range(0, height, self.up(ROWS_AT_ONCE)):
            found.append(self.rows(begin, min(height, begin + self.up(ROWS_AT_ONCE))))
        return stacked(found)

    def file_of(self, begin: int, end: int) -> str:
        """A file of these rows alone; there is one at a time."""
        oiio = image_library()
        spec, first = self.spec, self.spec.y
        y0, y1 = first + begin, first + end
        if spec.tile_width:
            deep = self.file.read_native_deep_tiles(
                self.part.index, 0, spec.x, spec.x + spec.width, y0, y1, 0, 1, 0, spec.nchannels
            )
        else:
            deep = self.file.read_native_deep_scanlines(
                self.part.index, 0, y0, y1, 0, 0, spec.nchannels
            )
        if deep is None:
            error = complaint(self.file) or "cannot be decoded"
            raise OSError(f"{self.name!r}: damaged: {error}")
        own = oiio.ImageSpec(spec.width, end - begin, spec.nchannels, spec.format)  # if of all
        own.channelnames, own.channelformats = spec.channelnames, spec.channelformats
        own.deep, own.x, own.y = True, spec.x, y0
        own.attribute("compression", "none")
        path = os.path.join(self.folder.name, "band.exr")
        out = oiio.ImageOutput.create(path)
        if out is None:
            raise OSError(f"{path!r}: {complaint(oiio)}")
        written = out.open(path, own) and out.write_deep_image(deep)
        error = complaint(out)
        if not (out.close() and written):
            raise lost(path, path, error or complaint(out) or "OpenImageIO does not say why")
        if not is_whole(path):
            raise lost(path, path, "what OpenImageIO wrote is not whole")
        del deep
        return path
