"""The reference rasteriser of 3D Gaussian Splatting in NumPy: written from its formulas, in double.

One splat after the other over the whole picture, by depth; nothing of it is moit's.
"""

import numpy as np

C1 = 0.4886025119029199
# Of degrees 2 and 3: the normalisation of each, and its polynomial on the sphere.
HIGHER = [
    (1.0925484305920792, lambda x, y, z: x * y),
    (-1.0925484305920792, lambda x, y, z: y * z),
    (0.31539156525252005, lambda x, y, z: 3 * z * z - 1),
    (-1.0925484305920792, lambda x, y, z: x * z),
    (0.5462742152960396, lambda x, y, z: x * x - y * y),
    (-0.5900435899266435, lambda x, y, z: y * (3 * x * x - y * y)),
    (2.890611442640554, lambda x, y, z: x * y * z),
    (-0.4570457994644658, lambda x, y, z: y * (5 * z * z - 1)),
    (0.3731763325901154, lambda x, y, z: z * (5 * z * z - 3)),
    (-0.4570457994644658, lambda x, y, z: x * (5 * z * z - 1)),
    (1.445305721320277, lambda x, y, z: z * (x * x - y * y)),
    (-0.5900435899266435, lambda x, y, z: x * (x * x - 3 * y * y)),
]


def colors(splats, eye):
    """Of degree 0 to 3."""
    d = splats.means.astype(float) - eye
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    sh = splats.sh.astype(float)
    seen = 0.28209479177387814 * sh[:, 0]
    x, y, z = d.T[:, :, None]
    if sh.shape[1] > 1:
        seen += -C1 * y * sh[:, 1] + C1 * z * sh[:, 2] - C1 * x * sh[:, 3]
    for k in range(4, sh.shape[1]):
        norm, polynomial = HIGHER[k - 4]
        seen += norm * polynomial(x, y, z) * sh[:, k]
    return np.maximum(seen + 0.5, 0)


def rotation_matrices(q):
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def picture(splats, camera, size, background):
    """(height, width, 3), and how many fragments each pixel blends."""
    width, height = size
    right, up, forward = camera.axes
    view = np.array([right, -up, forward])  # x to the right, y down, z away
    at = (splats.means.astype(float) - camera.eye) @ view.T
    tan_x, tan_y = 1 / np.array(camera.scale(size))
    focal_x, focal_y = width / (2 * tan_x), height / (2 * tan_y)
    axes = rotation_matrices(splats.rotations.astype(float)) * splats.scales[:, None, :]
    covariance = view @ axes @ axes.transpose(0, 2, 1) @ view.T
    shades = colors(splats, np.array(camera.eye))
    y, x = np.mgrid[:height, :width]
    image = np.zeros((height, width, 3))
    through = np.ones((height, width))
    done = np.zeros((height, width), bool)
    blended = np.zeros((height, width), int)
    for i in np.argsort(at[:, 2].astype(np.float32), kind="stable"):
        tx, ty, tz = at[i]
        if tz <= 0.2 or tz < camera.near or tz > camera.far:
            continue
        lx = np.clip(tx / tz, -1.3 * tan_x, 1.3 * tan_x) * tz
        ly = np.clip(ty / tz, -1.3 * tan_y, 1.3 * tan_y) * tz
        jacobian = np.array(
            [[focal_x / tz, 0, -focal_x * lx / tz**2], [0, focal_y / tz, -focal_y * ly / tz**2]]
        )
        own = jacobian @ covariance[i] @ jacobian.T
        on = own + 0.3 * np.eye(2)
        share = np.sqrt(max(0.000025, np.linalg.det(own) / np.linalg.det(on)))
        opacity = splats.opacities[i] * (share if splats.antialiased else 1)
        inverse = np.linalg.inv(on)
        middle = np.trace(on) / 2
        root = np.sqrt(max(0.1, middle**2 - np.linalg.det(on)))
        radius = np.ceil(3 * np.sqrt(middle + root))
        px = ((tx / tz / tan_x + 1) * width - 1) / 2
        py = ((ty / tz / tan_y + 1) * height - 1) / 2
        inside = (x // 16 >= np.trunc((px - radius) / 16)) & (
            x // 16 < np.trunc((px + radius + 15) / 16)
        )
        inside &= (y // 16 >= np.trunc((py - radius) / 16)) & (
            y // 16 < np.trunc((py + radius + 15) / 16)
        )
        dx, dy = px - x, py - y
        power = -0.5 * (inverse[0, 0] * dx**2 + inverse[1, 1] * dy**2) - inverse[0, 1] * dx * dy
        alpha = np.minimum(0.99, opacity * np.exp(power))
        there = inside & (power <= 0) & (alpha >= 1 / 255) & ~done
        after = through * (1 - alpha)
        done |= there & (after < 1e-4)
        there &= ~done
        image += np.where(there, alpha * through, 0)[..., None] * shades[i]
        through = np.where(there, after, through)
        blended += there
    return image + through[..., None] * np.asarray(background), blended
