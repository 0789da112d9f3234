"""Mutations of files: bytes and a random generator in, changed bytes out."""

import re

import hdf5_bytes

BOUNDARIES = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1,
              2**32, 2**63 - 1, 2**63, 2**64 - 1)
TEXT_NUMBERS = ("0", "-1", "1", "2", "65536", "2147483647", "2147483648", "4294967295",
                "4294967296", "9223372036854775807", "9223372036854775808",
                "18446744073709551616", "-9223372036854775808", "1e308", "1e999", "-1e308", "nan",
                "inf", "0.0000001", "99999999999999999999999999999999999999", "", "0x10", "1.5")
HEAD = 1024


def place(data, random):
    """A position, half of the time within the first kB."""
    if random.random() < 0.5:
        return random.randrange(min(len(data), HEAD))
    return random.randrange(len(data))


def flip_bits(data, random, _other):
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 4, 16))):
        out[place(data, random)] ^= 1 << random.randrange(8)
    return bytes(out)


def set_bytes(data, random, _other):
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        out[place(data, random)] = random.choice((0, 1, 0x7F, 0x80, 0xFE, 0xFF, 0x20, 0x0A,
                                                  random.randrange(256)))
    return bytes(out)


def set_word(data, random, _other):
    size = random.choice((2, 4, 8))
    at = place(data, random)
    if random.random() < 0.7:
        at -= at % random.choice((2, 4, size))
    value = random.choice(BOUNDARIES) & (256**size - 1)
    word = value.to_bytes(size, random.choice(("little", "big")))
    return (data[:at] + word + data[at + size:])[:max(len(data), 1)]


def add_to_word(data, random, _other):
    size = random.choice((1, 2, 4, 8))
    at = place(data, random)
    at -= at % size
    order = random.choice(("little", "big"))
    value = int.from_bytes(data[at:at + size], order) + random.choice((-1, 1, -8, 8, 255, 2**16))
    return data[:at] + (value % 256**size).to_bytes(size, order) + data[at + size:]


def truncate(data, random, _other):
    return data[:place(data, random)]


def chunk_of(data, random):
    at = place(data, random)
    return at, min(len(data), at + random.choice((1, 4, 16, 64, 512, 4096)))


def delete(data, random, _other):
    begin, end = chunk_of(data, random)
    return data[:begin] + data[end:]


def duplicate(data, random, _other):
    begin, end = chunk_of(data, random)
    return data[:end] + data[begin:end] * random.choice((1, 1, 3, 50)) + data[end:]


def swap(data, random, _other):
    (a, b), (c, d) = sorted((chunk_of(data, random), chunk_of(data, random)))
    if b > c:
        return data[:a] + data[a:b][::-1] + data[b:]
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def splice(data, random, other):
    begin, end = chunk_of(other, random)
    at = place(data, random)
    over = random.choice((0, end - begin))
    return data[:at] + other[begin:end] + data[at + over:]


def graft(data, random, other):
    return data[:place(data, random)] + other[place(other, random):]


def text_number(data, random, _other):
    numbers = list(re.finditer(rb"-?\d+(\.\d+)?", data[:HEAD] if random.random() < 0.5 else data))
    if not numbers:
        return set_word(data, random, _other)
    for found in sorted(random.sample(numbers, min(len(numbers), random.choice((1, 1, 2)))),
                        key=lambda match: -match.start()):
        new = random.choice(TEXT_NUMBERS).encode()
        data = data[:found.start()] + new + data[found.end():]
    return data


def text_line(data, random, other):
    lines = data.split(b"\n")
    at = random.randrange(min(len(lines), 40))
    what = random.randrange(5)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines.insert(at, lines[at])
    elif what == 2:
        there = random.randrange(min(len(lines), 40))
        lines[at], lines[there] = lines[there], lines[at]
    elif what == 3:
        lines[at] = random.choice(other.split(b"\n")[:40])
    else:
        lines[at] *= random.choice((2, 100, 5000))
    return b"\n".join(lines)


def text_word(data, random, other):
    """Removes a word, repeats it, or replaces it with a different one."""
    words = list(re.finditer(rb"[A-Za-z_.]{2,}|[\"'<>{}\[\]():,=/]", data[:HEAD]))
    if not words:
        return flip_bits(data, random, other)
    found = random.choice(words)
    new = random.choice((b"", found.group() * 2, found.group() * 300,
                         random.choice(words).group(), b"../", b"%s%n", b"\0", b"\xff\xfe"))
    return data[:found.start()] + new + data[found.end():]


def text_value(data, random, other):
    """Replaces a quoted string with a different one or with a number; the syntax remains valid."""
    values = list(re.finditer(rb'"([^"<>\n]*)"', data[:HEAD * 4]))
    if not values:
        return text_number(data, random, other)
    found = random.choice(values)
    new = random.choice((random.choice(values)[1], random.choice(TEXT_NUMBERS).encode(),
                         found[1] * 2, found[1][:len(found[1]) // 2], b" " + found[1], b"A" * 5000))
    return data[:found.start(1)] + new + data[found.end(1):]


def empty(_data, _random, _other):
    return b""


BINARY = (flip_bits, flip_bits, set_bytes, set_bytes, set_word, set_word, set_word, add_to_word,
          add_to_word, truncate, delete, duplicate, swap, splice, graft)
TEXT = (text_number, text_number, text_number, text_value, text_value, text_value, text_line,
        text_line, text_word)


def is_text(data):
    head = data[:200]
    return all(c in b"\t\r\n" or 32 <= c < 127 for c in head)


def mutated(data, random, other):
    """One to four mutations; `other` is a file from which pieces may be copied."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        if not data:
            break
        ways = TEXT if is_text(data) and random.random() < 0.75 else BINARY
        way = empty if random.random() < 0.002 else random.choice(ways)
        data = way(data, random, other or b"\0")
        data = data[:4 << 20]
    if data.startswith(b"\x89HDF") and random.random() < 0.7:
        data = hdf5_bytes.summed_anew(data)
    return data
