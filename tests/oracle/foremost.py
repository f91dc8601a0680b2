"""Techniques that keep the nearest fragments as they are, in mpmath, for differences.

Everitt 2001; Bavoil et al. 2007; Maule et al. 2013, with the threshold of Hahlbohm et al. 2025.
"""

from mpmath import mp, mpf

from tests.oracle.states import product

KINDS = ("depth-peeling", "kbuffer", "hybrid")


def foremost(technique, depth, alpha):
    """The nearest that count, in order."""
    least = getattr(technique, "core_alpha", 0)
    order = sorted(range(len(depth)), key=lambda i: depth[i])
    return [i for i in order if alpha[i] >= least][: technique.layers]


def one_by_one(order, alpha):
    T, through = [mpf(0)] * len(alpha), mpf(1)
    for i in order:
        T[i] = through
        through *= 1 - alpha[i]
    return T, through


def in_k_buffer(technique, depth):
    """The order in which fragments are blended, from the nearest."""
    held, gone = [], []
    for i in range(len(depth)):
        held.append(i)
        if len(held) > technique.layers:
            gone.insert(0, held.pop(held.index(max(held, key=lambda k: depth[k]))))
    return sorted(held, key=lambda i: depth[i]) + gone


def seen(technique, depth, alpha):
    """Transmittance in front of each fragment, and what a pixel lets through."""
    if technique.kind == "kbuffer":
        return one_by_one(in_k_buffer(technique, depth), alpha)
    drawn = foremost(technique, depth, alpha)
    T, core = one_by_one(drawn, alpha)
    tail = [i for i in range(len(alpha)) if i not in drawn]
    if technique.kind == "depth-peeling":
        for i in tail:
            T[i] = core
        return T, product(alpha) if technique.normalize else core
    rest = [alpha[i] for i in tail]
    total = mp.fsum(rest)
    covered = 1 - (product(rest) if technique.normalize else (1 - total / len(rest)) ** len(rest))
    for i in tail:
        T[i] = core * covered / total
    return T, core * (1 - covered)
