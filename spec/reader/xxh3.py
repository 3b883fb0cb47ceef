"""Computes XXH3 with a 64-bit result, seed 0 and the default secret, the checksum of files (format.md, 1.3).

The code follows the algorithm's public specification (xxHash 0.8). Input above 240 bytes is read in blocks of 1024. The
16 stripes of a block add to the eight accumulators amounts that do not depend on the accumulators. numpy therefore
computes these sums for many blocks at once, and only the mixing between blocks is a loop.
"""

import numpy as np

SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
PRIME32_1, PRIME32_2, PRIME32_3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
PRIME64_1, PRIME64_2, PRIME64_3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
PRIME64_4, PRIME64_5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5
PRIME_MX1, PRIME_MX2 = 0x165667919E3779F9, 0x9FB21C651E98DF25
MASK = (1 << 64) - 1

STRIPE, STRIPES_PER_BLOCK = 64, 16
BLOCK = STRIPE * STRIPES_PER_BLOCK
BLOCKS_AT_ONCE = 1024  # 1 MiB of input, so that numpy's temporaries stay small


def read(data, at, size=8):
    return int.from_bytes(data[at : at + size], "little")


def fold(a, b):
    """XORs the two halves of the 128-bit product."""
    product = (a & MASK) * (b & MASK)
    return (product & MASK) ^ (product >> 64)


def avalanche(h):
    h &= MASK
    h = (h ^ h >> 37) * PRIME_MX1 & MASK
    return h ^ h >> 32


def avalanche_of_xxh64(h):
    h = (h ^ h >> 33) * PRIME64_2 & MASK
    h = (h ^ h >> 29) * PRIME64_3 & MASK
    return h ^ h >> 32


def rotate(h, by):
    return (h << by | h >> (64 - by)) & MASK


def short(data):
    n = len(data)
    if n == 0:
        return avalanche_of_xxh64(read(SECRET, 56) ^ read(SECRET, 64))
    if n <= 3:
        combined = data[n - 1] | n << 8 | data[0] << 16 | data[n >> 1] << 24
        return avalanche_of_xxh64(combined ^ read(SECRET, 0, 4) ^ read(SECRET, 4, 4))
    if n <= 8:
        h = read(data, n - 4, 4) + (read(data, 0, 4) << 32) ^ read(SECRET, 8) ^ read(SECRET, 16)
        h = (h ^ rotate(h, 49) ^ rotate(h, 24)) * PRIME_MX2 & MASK
        h = (h ^ (h >> 35) + n) * PRIME_MX2 & MASK
        return h ^ h >> 28
    low = read(data, 0) ^ read(SECRET, 24) ^ read(SECRET, 32)
    high = read(data, n - 8) ^ read(SECRET, 40) ^ read(SECRET, 48)
    swapped = int.from_bytes(low.to_bytes(8, "little"), "big")
    return avalanche(n + swapped + high + fold(low, high))


def middle(data):
    def mix(at, key):
        return fold(read(data, at) ^ read(SECRET, key), read(data, at + 8) ^ read(SECRET, key + 8))

    n = len(data)
    total = n * PRIME64_1
    if n <= 128:
        for i in range((n + 31) // 32):
            total += mix(16 * i, 32 * i) + mix(n - 16 * (i + 1), 32 * i + 16)
        return avalanche(total)
    total = avalanche(total + sum(mix(16 * i, 16 * i) for i in range(8)))
    total += sum(mix(16 * i, 16 * (i - 8) + 3) for i in range(8, n // 16))
    return avalanche(total + mix(n - 16, 136 - 17))


def keys_at(starts):
    """Reads eight words of the secret from each of these bytes on."""
    return np.array([np.frombuffer(SECRET, "<u8", 8, at) for at in starts])


KEYS = keys_at(8 * i for i in range(STRIPES_PER_BLOCK))
KEYS_OF_SCRAMBLE = keys_at([len(SECRET) - 64])[0]
KEYS_OF_LAST = keys_at([len(SECRET) - 64 - 7])


def sums_of_stripes(words, keys):
    """The sums that stripes [blocks, stripes, 8 words] add to the accumulators, for each block."""
    keyed = words ^ keys
    products = (keyed & np.uint64(0xFFFFFFFF)) * (keyed >> np.uint64(32))
    products += words[..., [1, 0, 3, 2, 5, 4, 7, 6]]
    return products.sum(axis=1, dtype=np.uint64)


def long(data):
    n = len(data)
    accumulators = np.array(
        [PRIME32_3, PRIME64_1, PRIME64_2, PRIME64_3, PRIME64_4, PRIME32_2, PRIME64_5, PRIME32_1], np.uint64
    )
    blocks = (n - 1) // BLOCK
    for first in range(0, blocks, BLOCKS_AT_ONCE):
        count = min(BLOCKS_AT_ONCE, blocks - first)
        words = np.frombuffer(data, "<u8", count * BLOCK // 8, first * BLOCK)
        for block in sums_of_stripes(words.reshape(count, STRIPES_PER_BLOCK, 8), KEYS):
            accumulators += block
            accumulators ^= accumulators >> np.uint64(47)
            accumulators ^= KEYS_OF_SCRAMBLE
            accumulators *= np.uint64(PRIME32_1)
    stripes = (n - 1 - blocks * BLOCK) // STRIPE
    words = np.frombuffer(data, "<u8", stripes * 8, blocks * BLOCK).reshape(1, stripes, 8)
    accumulators += sums_of_stripes(words, KEYS[:stripes])[0]
    accumulators += sums_of_stripes(np.frombuffer(data, "<u8", 8, n - STRIPE).reshape(1, 1, 8), KEYS_OF_LAST)[0]
    words = [int(word) for word in accumulators]
    total = n * PRIME64_1
    for i in range(4):
        key = 11 + 16 * i
        total += fold(words[2 * i] ^ read(SECRET, key), words[2 * i + 1] ^ read(SECRET, key + 8))
    return avalanche(total)


def xxh3_64(data):
    """Returns the checksum of these bytes."""
    data = bytes(data)
    if len(data) <= 16:
        return short(data)
    return middle(data) if len(data) <= 240 else long(data)
