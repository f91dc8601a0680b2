"""What light reaches through transparent casters: maps of them."""

from __future__ import annotations

from moit.shadows.shadow_map import OpaqueShadowMap, ShadowMap

__all__ = ["OpaqueShadowMap", "ShadowMap"]
