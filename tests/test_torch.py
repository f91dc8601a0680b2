"""PyTorch's operators: they pass its own checks, and answer what moit answers."""

import doctest

import numpy as np
import pytest
from ragged_rays import ENDS, NAMES, QUESTIONS, TECHNIQUES, numbers

import moit
from moit import gradients

torch = pytest.importorskip("torch", reason="PyTorch (moit[torch]) is not installed")
moit_torch = pytest.importorskip("moit.torch")


def tensors(requires_grad, dtype=np.float64):
    held = {name: torch.from_numpy(one) for name, one in numbers(dtype).items()}
    return {name: one.requires_grad_(requires_grad) for name, one in held.items()}


def asked(question, technique, given):
    """The answer of a question to which `given` has what it asks for."""
    how = {"technique": technique, "offsets": torch.tensor(ENDS), "depth_range": (1, 6)}
    return getattr(moit_torch, question)(**{n: given[n] for n in QUESTIONS[question]}, **how)


def fragments(given, **options):
    return moit.Fragments(
        ENDS, given["depth"], given["alpha"], given["color"], depth_range=(1, 6), **options
    )


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize("question", QUESTIONS)
def test_gradcheck_passes(question, technique):
    names = QUESTIONS[question]

    def answer(*given):
        return asked(question, technique, dict(zip(names, given, strict=True)))

    given = tensors(requires_grad=True)
    assert torch.autograd.gradcheck(answer, [given[name] for name in names])


@pytest.mark.parametrize("question", QUESTIONS)
def test_opcheck_passes(question):
    given = tensors(requires_grad=True)
    arrays = [given[name] if name in QUESTIONS[question] else None for name in NAMES]
    others = (torch.tensor(ENDS), question, "power4", [1.0, 6.0], None)
    torch.library.opcheck(moit_torch._answer, (*arrays, *others))
    detached = [one if one is None else one.detach() for one in arrays]
    seed = torch.ones(asked(question, "power4", given).shape, dtype=torch.float64)
    torch.library.opcheck(moit_torch._pull, (seed, *detached, *others))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gradients_are_those_of_moit(dtype):
    given = tensors(requires_grad=True, dtype=dtype)
    del given["transmission"]
    ends, behind = torch.tensor(ENDS), given.pop("background")
    image = moit_torch.composite(
        **given, offsets=ends, technique="power6", background=behind, depth_range=(1, 6)
    )
    plain = numbers(dtype)
    expected, pullback = gradients.composite(
        fragments(plain), "power6", background=plain["background"][None]
    )
    assert image.dtype == torch.from_numpy(expected).dtype
    assert np.array_equal(image.detach().numpy(), expected[0])
    image.sum().backward()
    by = pullback(np.ones_like(expected))
    for name, one in given.items():
        assert np.array_equal(one.grad.numpy(), getattr(by, name)), name
    assert np.array_equal(behind.grad.numpy(), by.background[0])


def test_tensors_are_read_where_they_are(monkeypatch):
    given, seen = tensors(requires_grad=False), []
    whole = moit_torch.ragged.question_of

    def spied(*arguments):
        question = whole(*arguments)
        f = question.question.given[0]
        seen.append([f.depth, f.alpha, f.color, f.transmission])
        return question

    monkeypatch.setattr(moit_torch.ragged, "question_of", spied)
    asked("transmittance", "sorted", given)
    held = [given[name].numpy() for name in NAMES[:4]]
    assert all(np.shares_memory(a, b) for a, b in zip(seen[0], held, strict=True))


def test_layouts_of_rays_answer_alike():
    given = tensors(requires_grad=False)
    del given["transmission"], given["background"]
    counts = torch.tensor(ENDS).diff()
    packed = torch.stack([torch.tensor(ENDS)[:-1], counts], dim=1)
    rays = torch.repeat_interleave(torch.arange(3), counts)
    layouts = (
        {"offsets": torch.tensor(ENDS)},
        {"packed_info": packed},
        {"ray_indices": rays, "n_rays": 3},
    )
    found = [moit_torch.composite(**given, technique="power4", **one) for one in layouts]
    assert all(torch.equal(found[0], one) for one in found[1:])
    assert found[0].shape == (3, 4)
    assert not found[0][1].any()


def splats(requires_grad):
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(20, 4)) * 3
    scales, opacities = rng.uniform(0.05, 0.3, (20, 3)), rng.uniform(0.1, 0.9, 20)
    arrays = (rng.normal(size=(20, 3)) / 3, scales, turns, opacities)
    found = [torch.from_numpy(one.astype(np.float32)) for one in arrays]
    return [one.requires_grad_(requires_grad) for one in found]


def test_pictures_of_splats_are_those_of_moit():
    camera, size, given = moit.Camera(eye=(0.5, 0.3, 2)), (24, 16), splats(requires_grad=True)
    colors = torch.rand(20, 3, generator=torch.Generator().manual_seed(1)).requires_grad_()
    behind = torch.tensor([0.1, 0.2, 0.3], requires_grad=True)
    how = {"camera": camera, "size": size, "technique": "power4", "background": behind}
    image = moit_torch.render(*given, colors=colors, **how)
    plain = moit.Splats(*(one.detach().numpy() for one in given), colors=colors.detach().numpy())
    expected, pullback = gradients.render(
        plain, camera, size, "power4", background=behind.detach().numpy()
    )
    np.testing.assert_allclose(image.detach().numpy(), expected, atol=1e-6)
    image.square().sum().backward()
    by = pullback(2 * expected)
    turned = by.rotations / given[2].detach().norm(dim=1, keepdim=True).numpy()
    wanted = (by.means, by.scales, turned, by.opacities)
    for one, other in zip(given, wanted, strict=True):
        np.testing.assert_allclose(one.grad, other, rtol=1e-3, atol=1e-3)
        assert one.grad.any()
    np.testing.assert_allclose(colors.grad, by.colors, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(behind.grad, by.background, rtol=1e-5)
    # quaternions have any length: along them nothing changes
    assert (given[2] * given[2].grad).sum(dim=1).abs().max() < 1e-4


def test_opcheck_passes_for_pictures():
    arrays = [*splats(requires_grad=True), torch.zeros(20, 1, 3), torch.zeros(3)]
    camera = [0.0, 0, 3, 0, 0, 0, 0, 1, 0, 0.8, 0.1, 100]
    others = (camera, [12, 8], "sorted", "exact", None)
    torch.library.opcheck(moit_torch._picture, (*arrays, *others))
    detached = [one.detach() for one in arrays]
    torch.library.opcheck(moit_torch._pull_picture, (torch.ones(8, 12, 4), *detached, *others))


def test_whole_graphs_are_compiled():
    given = tensors(requires_grad=True)

    def loss(depth):
        return asked("composite", "power4", given | {"depth": depth}).square().sum()

    compiled = torch.compile(loss, fullgraph=True, backend="aot_eager")
    depth = given["depth"]
    found = [torch.autograd.grad(one(depth), depth)[0] for one in (loss, compiled)]
    assert torch.equal(*found)
    assert found[0].abs().max() > 0


def test_what_does_not_fit_is_refused():
    depth = torch.ones(2)
    how = {"technique": "sorted", "offsets": torch.tensor([0, 2])}
    with pytest.raises(TypeError, match="alpha: expected a tensor, got list"):
        moit_torch.transmittance(depth, [0.5, 0.5], **how)
    with pytest.raises(TypeError, match="alpha: expected a tensor, got NoneType"):
        moit_torch.transmittance(depth, None, **how)
    with pytest.raises(TypeError, match="depth: expected a tensor, got NoneType"):
        moit_torch.composite(None, depth, depth, **how)
    with pytest.raises(TypeError, match="alpha: expected float32 as depth has, got float64"):
        moit_torch.transmittance(depth, depth.double() / 2, **how)
    with pytest.raises(TypeError, match=r"depth: expected float32 or float64, got .*bfloat16"):
        moit_torch.transmittance(depth.bfloat16(), depth.bfloat16() / 2, **how)
    with pytest.raises(ValueError, match="depth: expected a tensor on the CPU, got one on meta"):
        moit_torch.transmittance(depth.to("meta"), depth / 2, **how)
    with pytest.raises(ValueError, match=r"technique: .* has no derivatives"):
        moit_torch.transmittance(depth, depth / 2, **(how | {"technique": "mlab4"}))


def test_examples_run():
    found = doctest.testmod(moit_torch)
    assert found.attempted and not found.failed
