"""A reader of OpenEXR's scanline files with ZIP compression, from the file format's description alone."""

import pathlib
import struct
import zlib


class Exr:
    """`header`: attributes by name; `channels`: rows of floats by channel name."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        assert struct.unpack_from("<I", data)[0] == 20000630, f"{path}: no EXR"
        assert struct.unpack_from("<I", data, 4)[0] & 0x1E00 == 0, f"{path}: not one part of scanlines"
        at, self.header, kinds = 8, {}, {}
        while data[at]:
            name, at = self._text(data, at)
            kind, at = self._text(data, at)
            (size,) = struct.unpack_from("<i", data, at)
            at += 4
            self.header[name], kinds[name] = data[at : at + size], kind
            at += size
        at += 1
        x0, y0, x1, y1 = struct.unpack("<4i", self.header["dataWindow"])
        self.width, self.height = x1 - x0 + 1, y1 - y0 + 1
        assert self.header["compression"][0] == 3, "ZIP, 16 lines a block"
        listed, i, body = [], 0, self.header["channels"]
        while body[i]:
            name, i = self._text(body, i)
            listed.append((name, struct.unpack_from("<i", body, i)[0]))
            i += 16
        self.channels = {name: [] for name, _ in listed}
        blocks = (self.height + 15) // 16
        for offset in struct.unpack_from(f"<{blocks}Q", data, at):
            y, size = struct.unpack_from("<2i", data, offset)
            lines = min(16, self.height - (y - y0))
            self._block(data[offset + 8 : offset + 8 + size], lines, listed)
        self.texts = {n: v.decode() for n, v in self.header.items() if kinds[n] == "string"}

    @staticmethod
    def _text(data, at):
        end = data.index(b"\0", at)
        return data[at:end].decode(), end + 1

    def _block(self, packed, lines, listed):
        sizes = {1: 2, 2: 4}  # half, float
        whole = lines * self.width * sum(sizes[kind] for _, kind in listed)
        if len(packed) < whole:
            raw = bytearray(zlib.decompress(packed))
            for i in range(1, len(raw)):  # each byte was the difference from the one before
                raw[i] = (raw[i - 1] + raw[i] - 128) & 255
            half = (len(raw) + 1) // 2
            plain = bytearray(len(raw))
            plain[0::2], plain[1::2] = raw[:half], raw[half:]
        else:
            plain = packed
        assert len(plain) == whole
        at = 0
        for _ in range(lines):
            for name, kind in listed:
                self.channels[name].append(struct.unpack_from(f"<{self.width}{'xef'[kind]}", plain, at))
                at += self.width * sizes[kind]

    def pixels(self, name):
        """A channel's values, row by row."""
        return [value for row in self.channels[name] for value in row]
