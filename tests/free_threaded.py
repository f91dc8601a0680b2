"""Threads of Python put the same objects to moit at once: python tests/free_threaded.py [SECONDS]

Where Python is free-threaded, moit must leave the lock off, and every thread really computes at
once; elsewhere they only take turns. Each answer has the bits that it had alone. Needs NumPy alone:
OpenImageIO and OpenEXR need not have wheels for such a Python. Exits with 1 where the lock is on, a
call fails or an answer differs.
"""

import random
import sys
import sysconfig
import threading
import time
import warnings

import numpy as np

warnings.simplefilter("error")  # Python says by one that the lock came back

import moit  # noqa: E402
from moit import _core  # noqa: E402

THREADS = 8


def some_fragments(dtype: str) -> moit.Fragments:
    rng = np.random.default_rng(3)
    counts = rng.integers(0, 12, 48 * 32)
    many = int(counts.sum())
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.uniform(1, 10, many).astype(dtype),
        rng.uniform(0.05, 0.9, many).astype(dtype),
        rng.random((many, 3)).astype(dtype),
        shape=(32, 48),
    )


def pulled(f: moit.Fragments, technique) -> tuple[np.ndarray, ...]:
    image, pullback = moit.gradients.composite(f, technique, threads=2)
    by = pullback(image)
    return image, by.depth, by.alpha, by.color


def questions() -> dict:
    """Calls by name, each of objects that all threads share."""
    found = {}
    for dtype in ("float32", "float64"):
        f = some_fragments(dtype)
        for name in moit.techniques():
            technique = moit.technique(name)

            def ask(f=f, technique=technique):
                image = moit.composite(f, technique, threads=2)
                return image, *moit.bounds(f, technique), moit.total_transmittance(f, technique)

            found[f"{name} {dtype}"] = ask
            if technique.has_gradient and not _core.gradient_refusal(technique.fields_for(f)):
                found[f"pullback {name} {dtype}"] = lambda f=f, t=technique: pulled(f, t)
    f = some_fragments("float32")
    images = [moit.composite(f, name)[..., :3] for name in ("sorted", "wboit")]
    reference = moit.metrics.Reference(images[0])
    found["errors"] = lambda: (np.float64(list(reference.errors(images[1]).values())),)
    scene = moit.scenes.meshes("spheres-mesh")
    shadows = moit.ShadowMap("spheres-mesh", "power4", light=(0.3, -1.0, 0.2), resolution=32)
    points = scene.meshes[0].vertices[::17]
    found["shadows"] = lambda: (shadows.transmittance(points),)
    found["render"] = lambda: (moit.render("spheres-mesh", "power4", (48, 27)),)
    found["list"] = lambda: (moit.rasterize(scene.meshes, scene.camera, (48, 27)).depth,)
    return found


def bits(arrays) -> bytes:
    return b"".join(np.ascontiguousarray(one).tobytes() for one in arrays)


def main() -> int:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    is_free = bool(sysconfig.get_config_var("Py_GIL_DISABLED"))
    is_locked = getattr(sys, "_is_gil_enabled", lambda: True)()
    asked = questions()
    needed = {name: bits(ask()) for name, ask in asked.items()}
    wrong: list[str] = []
    calls = [0] * THREADS
    ends = time.monotonic() + seconds
    begin = threading.Barrier(THREADS)

    def work(number: int) -> None:
        order = random.Random(number)
        begin.wait()
        while time.monotonic() < ends and not wrong:
            name = order.choice(list(asked))
            try:
                if bits(asked[name]()) != needed[name]:
                    wrong.append(f"{name}: other bits")
            except Exception as error:
                wrong.append(f"{name}: {error!r}")
            calls[number] += 1

    threads = [threading.Thread(target=work, args=(k,)) for k in range(THREADS)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    is_locked = is_locked or getattr(sys, "_is_gil_enabled", lambda: True)()
    print("\n".join(wrong[:20]))
    lock = "has the lock on" if is_locked else "leaves the lock off"
    print(f"Python {sys.version.split()[0]} {lock}: {sum(calls)} calls of {len(asked)} kinds by")
    print(f"{THREADS} threads at once, {len(wrong)} wrong")
    return bool(wrong or (is_free and is_locked))


if __name__ == "__main__":
    sys.exit(main())
