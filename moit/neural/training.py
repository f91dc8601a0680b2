"""Training: from fragments to a Network, by a recipe, with checkpoints."""

from __future__ import annotations

import dataclasses
import itertools
import math
import numbers
import os
import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.catalog.network import SIZES, Network, NetworkError
from moit.checks.arguments import one_of, path_name, truth, whole
from moit.checks.exceptions import FragmentsError
from moit.checks.randomness import MOST_SEED, seed_of
from moit.core.pieces import surfaces
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments, choices
from moit.neural import checkpoint as checkpoints
from moit.neural import data as sets
from moit.neural.backpropagation import Adam
from moit.neural.examples import digest, examples_of, joined, network_kind, seen, some
from moit.neural.fitting import Schedule, State, fit
from moit.neural.losses import LOSSES
from moit.neural.recipes import Recipe
from moit.neural.recipes import recipe as recipe_named
from moit.neural.scores import scores
from moit.system.progress import Progress, preparing, steps

Data = str | os.PathLike[str] | Fragments

SECONDS_BETWEEN_CHECKPOINTS = 10.0
HELD_OUT = 0.1  # of all pixels: what the second curve of losses is measured on


def train(
    technique: str | Technique = "neural-bounded",
    data: Data | Iterable[Data] | None = None,
    *,
    recipe: str = "quick",
    fragments: int | None = None,
    epochs: int | None = None,
    batch: int | None = None,
    rate: float | None = None,
    loss: str | None = None,
    seed: int = 0,
    rng: Any = None,
    checkpoint: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> Network:
    """A network for a technique that has one, trained on fragments.

    technique : one that runs a network, or its name, such as "neural", "dfa", "neural-bounded" or
        "neural-bounded6", with options such as its depth warp. What its network sees of fragments
        is what this one learns from.
    data : what to learn from: names of sets of random rays of moit.neural.data ("layers",
        "surfaces", "puffs", "tufts", "sheets", "haze", "veils", "neural-training"), of scenes,
        paths, or Fragments, which need no colour. Opaque surfaces and what they hide are left out.
        A source weighs the less, the more is lost on it where no order is known. None: the
        recipe's.
    recipe : "quick", some seconds on the first four sets; "paper", as NMT's section 3.2 has it:
        250,000 fragments of "neural-training", 1000 epochs, batches of 8192, Adam with .001,
        squared error of transmittance; "shipped", what made the networks that come with moit.
        The other arguments change it:
    fragments : how many of each source at most, in whole pixels, chosen at random; at least 1.
    epochs, batch : at least 1: how often each fragment is seen, and about how many to a step.
    rate : above 0: Adam's learning rate at the beginning.
    loss : "transmittance", the mean of (T - exact)^2; "visible", that of alpha^2 (T - exact)^2 and
        a tenth of it; "color", the expected squared error of a pixel of random colours, its
        weights renormalised; "picture", the same of colours that in part go with opacity.
    seed : an integer of at least 0: of random rays, initial weights and shuffling. The same
        arguments give the same bits on one machine with the same number of threads.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.
    checkpoint : a file where the training is kept every ten seconds and when it is interrupted.
    resume : go on from `checkpoint`, to the very network that would have come of one run.
    progress : True, False, or a function (done, total, label) as in `compare`; steps are epochs.
    part, layer : of each deep EXR that is given by path, as `composite`.

    Returns a Network whose `recipe`, `data_hash` and `scores` say how it was made and how good it
    is on the four sets. A tenth of all pixels is held out; `recipe["losses"]` has the loss on what
    was learnt from and on these, at up to fifty epochs.

    Raises TypeError and ValueError for arguments that do not fit; FragmentsError for data without
    a transparent fragment or with depth that the technique cannot take; checkpoint.CheckpointError
    for one that is damaged or of another training; FloatingPointError where the loss is no number
    any more, or sums of weights are none, as too great a rate makes them; KeyboardInterrupt with a
    message that says how to go on.

    >>> network = moit.train("neural-bounded", "surfaces", fragments=200, epochs=1, batch=100,
    ...     progress=False)
    >>> network.kind
    'neural-bounded'
    """
    chosen = _trainable(technique)
    plan = _planned(
        recipe, chosen, fragments=fragments, epochs=epochs, batch=batch, rate=rate, loss=loss
    )
    if data is not None:
        plan = dataclasses.replace(plan, weights=())
    number = whole("seed", seed_of(seed, rng), 0, MOST_SEED)
    if truth("resume", resume) and checkpoint is None:
        raise ValueError("resume: needs the checkpoint to go on from; got checkpoint=None")
    path = None if checkpoint is None else path_name(checkpoint, "checkpoint")
    given = plan.data if data is None else data
    with preparing(progress, "training") as first:
        first.now("what is learnt from")
        sources = _sources(given, plan.fragments, number, part, layer)
        work = _Work(chosen, plan, sources, number)
        first.now("the first weights")
        state = checkpoints.read(path, work.facts) if resume and path else work.start()
    work.fit(state, path, progress)
    return work.network(state)


class _Work:
    """One training: what is learnt from, and what its checkpoints must agree on."""

    def __init__(
        self, technique: Technique, plan: Recipe, sources: dict[str, Fragments], seed: int
    ) -> None:
        self.technique, self.plan = technique, plan
        self.hash = digest(list(sources.values()))
        self.schedule = Schedule(plan.epochs, plan.batch, plan.rate, plan.falling, plan.loss, seed)
        rng = np.random.default_rng((seed, 0, 1))
        learnt, held_out, ease, ease_of_held = [], [], [], []
        of_sources = zip(sources.items(), plan.weights or [1.0] * len(sources), strict=True)
        for ((name, f), weight), one in itertools.product(of_sources, plan.read_by(technique)):
            part = examples_of(some(f, round(plan.fragments / (1 - HELD_OUT)), rng), one, name)
            order = rng.permutation(len(part.truth.counts))
            held = round(HELD_OUT * len(order))
            learnt.append(part.taken(order[held:]).for_loss(plan.loss).at_most(plan.fragments))
            ease.append(learnt[-1].ease(plan.loss) * weight)
            if held:
                held_out.append(part.taken(order[:held]).for_loss(plan.loss))
                ease_of_held.append(ease[-1])
        examples = joined(learnt, ease)
        self.mean = examples.features.mean(axis=0, dtype=np.float64)
        scale = examples.features.std(axis=0, dtype=np.float64)
        self.scale = np.where(scale > 0, scale, 1.0)
        self.examples = examples.standardised(self.mean, self.scale)
        self.held_out = (
            joined(held_out, ease_of_held).standardised(self.mean, self.scale) if held_out else None
        )
        self.sizes = SIZES[network_kind(technique)]
        self.facts: dict[str, Any] = {
            "technique": str(technique),
            "sizes": list(self.sizes),
            **plan.told(),
            "data": list(sources),
            "seed": seed,
            "data_hash": self.hash,
        }

    def start(self) -> State:
        """The best of a few beginnings: after a tenth of the epochs, on what is learnt from."""
        begun = []
        short = dataclasses.replace(
            self.schedule, epochs=max(self.plan.epochs // 10, 1), falling=False
        )
        for number in range(self.plan.starts):
            state = State.start(self.sizes, self.schedule.seed + number)
            if self.plan.starts > 1:
                fit(state, self.examples, None, short)
            begun.append(state)
        best = min(begun, key=lambda one: one.losses[-1][0] if one.losses else math.inf)
        return State(best.network, Adam.for_parameters(best.network.parameters))

    def fit(self, state: State, path: str | None, progress: Progress) -> None:
        kept = state.copy()
        written = time.monotonic()
        try:
            with steps(progress, self.plan.epochs, "training") as step:
                for _ in range(state.epoch):
                    step("resumed")

                def after(now: State) -> None:
                    nonlocal kept, written
                    loss = now.losses[-1][0]
                    if not math.isfinite(loss):
                        raise FloatingPointError(
                            f"the loss of epoch {now.epoch} is {loss}; train with a lower rate"
                        )
                    kept = now.copy()
                    step(f"loss {loss:.3e}")
                    if path and time.monotonic() - written > SECONDS_BETWEEN_CHECKPOINTS:
                        checkpoints.write(path, kept, self.facts)
                        written = time.monotonic()

                with np.errstate(all="ignore"):  # a loss that is no number is an error of its own
                    fit(state, self.examples, self.held_out, self.schedule, after)
        except KeyboardInterrupt:
            if path is None:
                raise
            checkpoints.write(path, kept, self.facts)
            raise KeyboardInterrupt(
                f"interrupted after {kept.epoch} of {self.plan.epochs} epochs; the same call with "
                f"resume=True goes on from {path!r}"
            ) from None
        if path:
            checkpoints.write(path, state, self.facts)

    def network(self, state: State) -> Network:
        """What came of it, with its story."""
        perceptron = state.network
        shown = np.unique(np.linspace(1, state.epoch, 50).round().astype(int))
        losses = [(int(i), *(round(x, 9) for x in state.losses[i - 1])) for i in shown]
        try:
            made = Network(
                kind=network_kind(self.technique),
                weights=[one.copy() for one in perceptron.weights],
                biases=[one.copy() for one in perceptron.biases],
                mean=self.mean,
                scale=self.scale,
                recipe={**self.facts, "losses": losses},
                data_hash=self.hash,
            )
        except NetworkError as error:  # what data has was checked before: weights grew
            raise FloatingPointError(f"{error}; train with a lower rate") from None
        return dataclasses.replace(made, scores=scores(made, self.technique))


def _trainable(technique: str | Technique) -> Technique:
    chosen: Any = technique_named(technique)
    if network_kind(chosen) not in SIZES:
        raise ValueError(
            f"technique: {chosen} runs no network; those that do are {', '.join(SIZES)}"
        )
    # What its network sees does not hang on the network that it has now.
    untrained: Technique = dataclasses.replace(chosen, network=None)
    return untrained


def _planned(name: Any, technique: Technique, **changes: Any) -> Recipe:
    """The recipe with what the caller changes of it."""
    given = {option: value for option, value in changes.items() if value is not None}
    for option in ("fragments", "epochs", "batch"):
        if option in given:
            given[option] = whole(option, given[option], 1, 2**31 - 1)
    if "rate" in given:
        given["rate"] = _positive("rate", given["rate"])
    if "loss" in given:
        one_of("loss", given["loss"], tuple(LOSSES))
    return dataclasses.replace(recipe_named(name, network_kind(technique)), **given)


def _positive(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    number = float(value)
    if not 0 < number < math.inf:
        raise ValueError(f"{name}: expected a positive number, got {number}")
    return number


def _sources(
    data: Any, fragments: int, seed: int, part: int | str | None, layer: str | None
) -> dict[str, Fragments]:
    """The fragments that `data` means, by a name of each."""
    if isinstance(data, (str, os.PathLike, Fragments)):
        data = [data]
    if not isinstance(data, Iterable):
        raise TypeError(
            "data: expected Fragments, a path, the name of a set or a scene, or several; "
            f"got {type(data).__name__}"
        )
    found: dict[str, Fragments] = {}
    held = list(data)
    for i, (one, choice) in enumerate(zip(held, choices(held, part, layer), strict=True)):
        drawn = round(1.02 * fragments / (1 - HELD_OUT))
        if isinstance(one, str) and one in sets.NAMES:
            found[one] = sets.drawn(one, drawn, seed)
            continue
        f, _ = surfaces(as_fragments(one, f"data[{i}]", **choice))
        found[f"data[{i}]" if isinstance(one, Fragments) else path_name(one)] = seen(f)
    if not any(len(f) for f in found.values()):
        raise FragmentsError("data: found no transparent fragment; needed at least one")
    return found
