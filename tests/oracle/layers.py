"""Layer techniques as their papers tell them, a ray at a time in plain Python.

Each takes depth (n,), alpha (n,) and where it blends colours color (n, 3), in arrival order. `hold`
rounds what is held; by default it does not.
"""

import math

import numpy as np


def as_held(x):
    return x


def to_half(x):
    """As RGBA16F holds it, without infinities."""
    return np.clip(x, -65504.0, 65504.0).astype(np.float16).astype(np.float64)


def to_word(x):
    return math.floor(x * 65535 + 0.5) / 65535


def depth_peeling(k, depth, alpha):
    """(T (n,), total, drawn (n,)) of k passes, each drawing the first of the nearest left."""
    left = list(range(len(depth)))
    T, drawn, through = np.zeros(len(depth)), np.zeros(len(depth), bool), 1.0
    for _ in range(min(k, len(depth))):
        i = min(left, key=lambda i: depth[i])
        left.remove(i)
        T[i], drawn[i] = through, True
        through *= 1 - alpha[i]
    T[left] = through
    return T, through, drawn


def k_buffer(k, depth, alpha):
    """(T, total): the farthest of k + 1 leaves, over a tail that is dimmed by it."""
    T, held, tail = np.ones(len(depth)), [], []
    for i in range(len(depth)):
        held.append(i)
        if len(held) > k:
            far = max(held, key=lambda i: (depth[i], i))
            held.remove(far)
            T[tail] *= 1 - alpha[far]
            tail.append(far)
    total = 1.0
    for i in sorted(held, key=lambda i: (depth[i], i)):
        T[i] = total
        total *= 1 - alpha[i]
    T[tail] *= total
    return T, total * np.prod(1 - alpha[tail])


def hybrid(k, depth, alpha, core_alpha=0.0):
    """(T, total): the k nearest that have such an alpha, and n others behind them as n layers of
    their mean opacity."""
    strong = np.flatnonzero(alpha >= core_alpha)
    core = np.zeros(len(alpha), bool)
    T, total, core[strong] = depth_peeling(k, depth[strong], alpha[strong])
    T = np.concatenate([T, np.zeros(len(alpha) - len(strong))])
    T[strong], T[alpha < core_alpha] = T[: len(strong)].copy(), total
    tail = alpha[~core]
    if len(tail) and tail.any():
        covered = 1 - (1 - tail.mean()) ** len(tail)
        T[~core] = total * covered / tail.sum()
        total *= 1 - covered
    return T, total


def adaptive_nodes(count, depth, alpha, hold=as_held):
    """(depth, transmittance behind it) of each node, by the definition: the area between curves."""
    nodes = []
    for z, a in zip(depth, alpha, strict=True):
        at = sum(node[0] < z for node in nodes)
        before = nodes[at - 1][1] if at else 1.0
        behind = [(d, t * (1 - a)) for d, t in nodes[at:]]
        nodes = [*nodes[:at], (z, before * (1 - a)), *behind]
        if len(nodes) > count:
            areas = [
                (nodes[i][0] - nodes[i - 1][0]) * (nodes[i - 1][1] - nodes[i][1])
                for i in range(1, count)
            ]
            gone = 1 + int(np.argmin(areas))
            nodes[gone - 1 : gone + 1] = [(nodes[gone - 1][0], nodes[gone][1])]
        nodes = [(d, hold(t)) for d, t in nodes]
    return nodes


def adaptive_merged(count, depth, alpha, hold=as_held, place=as_held, extent=1.0):
    """The same, merged by energy; the depths of merged nodes are held by `place`."""
    nodes = []
    for z, a in zip(depth, alpha, strict=True):
        at = sum(node[0] < z for node in nodes)
        before = nodes[at - 1][1] if at else 1.0
        nodes[at:] = [(z, before * (1 - a)), *((d, t * (1 - a)) for d, t in nodes[at:])]
        if len(nodes) > count:
            D, T = np.array(nodes).T
            energy = np.append(1, T[:-1]) - T
            reaches = np.append(1, T[:-2])
            opacity = (reaches - T[1:]) / np.maximum(reaches, 1e-30)
            lost = np.minimum(energy[1:], energy[:-1]) * (opacity + 1.5 * np.diff(D) / extent)
            gone = 1 + int(np.argmin(lost))
            front, behind = energy[gone - 1], energy[gone]
            mean = D[gone - 1] + (D[gone] - D[gone - 1]) * behind / max(front + behind, 1e-30)
            mean = place(D[gone] if behind > 1.5 * front else mean)
            nodes[gone - 1 : gone + 1] = [(mean, T[gone])]
        nodes = [(d, hold(t)) for d, t in nodes]
    return nodes


def steps(nodes, z):
    """Transmittance in front of each of z."""
    T = np.ones(len(z))
    for d, t in nodes:
        T[np.asarray(z) > d] = t
    return T


def mlab_layers(count, depth, alpha, color, hold=as_held, least=0.0):
    """(depth, premultiplied colour, transmittance) of each layer, front to back."""
    layers = []
    for z, a, c in zip(depth, alpha, color, strict=True):
        if a < least:
            continue
        at = sum(layer[0] < z for layer in layers)
        layers.insert(at, (z, hold(a * c), hold(np.float64(1 - a))))
        if len(layers) > count:
            (d, front, through), (_, behind, left) = layers[-2:]
            layers[-2:] = [(d, hold(front + through * behind), hold(through * left))]
    return layers


def mlab_merged(count, depth, alpha, color, hold=as_held, least=0.0):
    """The same, merged by energy."""
    layers = []
    for z, a, c in zip(depth, alpha, color, strict=True):
        if a < least:
            continue
        at = sum(layer[0] < z for layer in layers)
        layers.insert(at, (z, hold(a * c), hold(np.float64(1 - a))))
        if len(layers) > count:
            energy = -np.diff(np.cumprod([1.0, *(layer[2] for layer in layers)]))
            gap = np.sqrt(np.diff([layer[0] for layer in layers]))
            both = np.maximum(energy[1:] + energy[:-1], 1e-30)
            gone = 1 + int(np.argmin(gap * (energy[1:] * energy[:-1] / both)))
            (front, c0, t0), (behind, c1, t1) = layers[gone - 1 : gone + 1]
            place = behind if energy[gone] > energy[gone - 1] else front
            layers[gone - 1 : gone + 1] = [(place, hold(c0 + t0 * c1), hold(t0 * t1))]
    return layers


def mlab_steps(layers):
    """The layers' transmittance as nodes."""
    through = np.cumprod([1.0, *(layer[2] for layer in layers)])[1:]
    return [(layer[0], t) for layer, t in zip(layers, through, strict=True)]


def mlab_image(layers):
    """(r, g, b, total)"""
    seen, through = np.zeros(3), 1.0
    for _, c, t in layers:
        seen += through * c
        through *= t
    return np.append(seen, through)
