"""Fourier opacity of any number of coefficients as a text for engines: what shaders/engine has of 7
and of 15, which tests hold this to."""

from __future__ import annotations

MOST = 31  # coefficients that the technique has: eight targets, as one pass has everywhere


def fourier_text(coefficients: int) -> str:
    """GLSL's subset, for an odd number from 3 to MOST."""
    harmonics = coefficients // 2
    numbers = _numbers(harmonics)
    if coefficients == MOST:  # two and one would be a ninth target
        numbers.append("0.0")
    members = [f"vec4 target{i};" for i in range(len(numbers) // 4)]
    members += [f"vec2 target{len(members)};"] if len(numbers) % 4 == 3 else []
    members += [f"float target{len(members)};"] if len(numbers) % 4 else []
    turns = ", ".join(
        [
            "vec2 p1 = on_the_circle(z)",
            *(f"p{k} = turned(p{k - k // 2}, p{k // 2})" for k in range(2, harmonics + 1)),
        ]
    )
    added = "".join(
        f"    o.target{i} = {_packed(part)} * a;\n" for i, part in enumerate(_by_target(numbers))
    )
    waves = _summed([_wave(k, len(numbers)) for k in range(1, harmonics + 1)])
    own = _summed([_share(k, f"p{k}.y") for k in range(1, harmonics + 1)])
    spare = ", and a number to spare" if len(numbers) > coefficients else ""
    return f"""\
// Fourier opacity maps of {coefficients} coefficients, kept in half floats; see fourier.glsl.
#include "engine/common.glsl"
#include "engine/fourier.glsl"

// The total, then a cosine and a sine of each harmonic, four a target{spare}.
struct sums {{ {" ".join(members)} }};

sums accumulate(float z, float alpha) {{
    float a = absorbance(alpha);
    {turns};
    sums o;
{added}    return o;
}}

float transmittance_of_sums(sums t, float z, float alpha) {{
    {turns};
    float waves = {waves};
    float own_waves = {own};
    return transmittance_by(t.target0.x, waves, own_waves, 0.5 * z + 0.5, alpha);
}}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) {{ return covered(shaded_sum, t.target0.x); }}
#endif
"""


def _numbers(harmonics: int) -> list[str]:
    """What a surface of absorbance 1 adds to each coefficient."""
    return ["1.0", *(f"p{k}.{side}" for k in range(1, harmonics + 1) for side in "xy")]


def _by_target(numbers: list[str]) -> list[list[str]]:
    """Four each, then two, then one."""
    whole = len(numbers) // 4 * 4
    rest = numbers[whole:]
    found = [numbers[at : at + 4] for at in range(0, whole, 4)]
    return [*found, *([rest[:2]] if len(rest) == 3 else []), *([rest[-1:]] if rest else [])]


def _packed(numbers: list[str]) -> str:
    """A number or a vector; a point's two numbers side by side are the point."""
    parts: list[str] = []
    for one in numbers:
        if one.endswith(".y") and parts and parts[-1] == f"{one[:-1]}x":
            parts[-1] = one[:-2]
        else:
            parts.append(one)
    return parts[0] if len(numbers) == 1 else f"vec{len(numbers)}({', '.join(parts)})"


def _place(at: int, coefficients: int) -> tuple[str, str]:
    """Of a coefficient: its target and its component, "" where that is a number."""
    whole = coefficients // 4 * 4
    if at < whole:
        return f"t.target{at // 4}", "xyzw"[at % 4]
    if coefficients - whole == 3 and at < whole + 2:
        return f"t.target{whole // 4}", "xy"[at - whole]
    return f"t.target{whole // 4 + (coefficients - whole == 3)}", ""


def _wave(k: int, coefficients: int) -> str:
    """What harmonic k adds of its two coefficients."""
    first, second = (_place(2 * k + i, coefficients) for i in (-1, 0))
    if first[0] == second[0]:
        pair = f"{first[0]}.{first[1]}{second[1]}"
    else:
        pair = f"vec2({', '.join('.'.join(filter(None, one)) for one in (first, second))})"
    return _share(k, f"harmonic({pair}, p{k})")


def _share(k: int, what: str) -> str:
    return what if k == 1 else f"{float(f'{1 / k:.8g}')} * {what}"


def _summed(terms: list[str]) -> str:
    """The first, then two and two: small ones together."""
    rest = [terms[at : at + 2] for at in range(1, len(terms), 2)]
    grouped = [f"({' + '.join(two)})" if len(two) == 2 else two[0] for two in rest]
    return " + ".join([terms[0], *grouped])
