"""Reads what a shared library asks of the loader, and changes it in place: 64-bit ELF, little-endian.

Based on: System V Application Binary Interface, chapter 5, and Linux Standard Base, symbol versions.
"""

import struct

LOAD, DYNAMIC = 1, 2  # kinds of segments
NEEDED, STRTAB, SONAME, RPATH, VERNEED, VERNEEDNUM = 1, 5, 14, 15, 0x6FFFFFFE, 0x6FFFFFFF


class SharedLibrary:
    """The bytes of a shared library.

    needed:   the names of the libraries that it links
    versions: pairs of a library and a version that it must define, such as "GLIBC_2.34"
    """

    def __init__(self, path):
        self.data = bytearray(path.read_bytes())
        if self.data[:6] != b"\x7fELF\x02\x01":
            raise ValueError(f"{path}: not a library of a 64-bit little-endian machine")
        begin, = struct.unpack_from("<Q", self.data, 32)
        size, count = struct.unpack_from("<HH", self.data, 54)
        segments = [struct.unpack_from("<IIQQQQ", self.data, begin + i * size) for i in range(count)]
        self._loads = [s for s in segments if s[0] == LOAD]
        self._dynamic = []
        for _, _, offset, _, _, length in (s for s in segments if s[0] == DYNAMIC):
            self._dynamic += struct.iter_unpack("<qQ", self.data[offset:offset + length])
        self._strings = self._offset(self._values(STRTAB)[0])

    @property
    def needed(self):
        return [self._text(name) for name in self._values(NEEDED)]

    @property
    def versions(self):
        return [(self._text(library), self._text(name))
                for library, names in self._version_needs() for name in names]

    def rename(self, names):
        """Gives libraries, this one or needed ones, the names in a dict, which are as long as before."""
        places = self._values(NEEDED) + self._values(SONAME)
        for place in places + [library for library, _ in self._version_needs()]:
            old = self._text(place)
            if old in names:
                assert len(names[old]) == len(old)
                self._write(place, names[old])

    def set_rpath(self, rpath):
        """Puts a search path in the place of a longer or equal one."""
        place, = self._values(RPATH)
        assert self._text(place).startswith(rpath)
        self._write(place, rpath)

    def _values(self, tag):
        return [value for found, value in self._dynamic if found == tag]

    def _offset(self, address):
        for _, _, offset, start, _, length in self._loads:
            if start <= address < start + length:
                return address - start + offset
        raise ValueError("an address lies outside of all segments")

    def _text(self, place):
        begin = self._strings + place
        return self.data[begin:self.data.index(0, begin)].decode()

    def _write(self, place, text):
        begin = self._strings + place
        old = len(self._text(place))
        self.data[begin:begin + old] = text.encode().ljust(old, b"\0")

    def _version_needs(self):
        """Pairs of the places of a library's name and of its versions' names."""
        needs = []
        for address in self._values(VERNEED):
            at = self._offset(address)
            for _ in range(self._values(VERNEEDNUM)[0]):
                _, count, library, first, following = struct.unpack_from("<HHIII", self.data, at)
                names, version = [], at + first
                for _ in range(count):
                    name, step = struct.unpack_from("<II", self.data, version + 8)
                    names.append(name)
                    version += step
                needs.append((library, names))
                at += following
        return needs
