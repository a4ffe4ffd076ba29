"""Pictures of media by Mitsuba, in a process of its own: `python testing/mitsuba/boundary.py SCENE.json PICTURES.npy`.

The boundary lets all light through and forgets its direction: so light enters by ENTRY_DIFFUSE, and so it always
leaves. No plugin of Mitsuba's own does that, and those in Python need its LLVM variants.
"""

import json
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")


class DiffuseBoundary(mi.BSDF):
    """Cosine-distributed transmission, from either side, of all light."""

    def __init__(self, properties: mi.Properties) -> None:
        super().__init__(properties)
        self.m_components = [mi.BSDFFlags.DiffuseTransmission | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
        self.m_flags = self.m_components[0]

    def sample(self, context, si, sample1, sample2, active=True):
        result = mi.BSDFSample3f()
        up = mi.warp.square_to_cosine_hemisphere(sample2)
        result.pdf = mi.warp.square_to_cosine_hemisphere_pdf(up)
        result.wo = mi.Vector3f(up.x, up.y, dr.mulsign(up.z, -mi.Frame3f.cos_theta(si.wi)))
        result.eta = 1.0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseTransmission)
        result.sampled_component = mi.UInt32(0)
        return result, mi.Color3f(1.0) & (active & (result.pdf > 0.0))

    def eval(self, context, si, wo, active=True):
        return mi.Color3f(self.pdf(context, si, wo, active))

    def pdf(self, context, si, wo, active=True):
        cosine = mi.Frame3f.cos_theta(wo)
        through = cosine * mi.Frame3f.cos_theta(si.wi) < 0.0
        return dr.select(active & through, dr.abs(cosine) * dr.inv_pi, 0.0)

    def eval_pdf(self, context, si, wo, active=True):
        value = self.pdf(context, si, wo, active)
        return mi.Color3f(value), value

    def to_string(self) -> str:
        return "DiffuseBoundary[]"


mi.register_bsdf("diffuse_boundary", DiffuseBoundary)


def mesh(vertices, triangles, path: Path, **children) -> dict:
    """A flat-shaded triangle mesh, by way of a PLY file at `path`."""
    rows = "\n".join(" ".join(f"{x:.9g}" for x in v) for v in vertices)
    faces = "\n".join("3 " + " ".join(map(str, t)) for t in triangles)
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n{rows}\n{faces}\n"
    )
    return {"type": "ply", "filename": str(path), "face_normals": True, **children}


def medium(sigma_t, alpha, g) -> dict:
    """A homogeneous medium; σ_t and α rgb."""
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "rgb", "value": [x / max(sigma_t) for x in sigma_t]},
        "scale": max(sigma_t),
        "albedo": {"type": "rgb", "value": alpha},
        "phase": {"type": "hg", "g": g},
    }


def scene(data: dict, folder: Path) -> dict:
    """A body under a point light, seen without perspective."""
    look = mi.ScalarTransform4f().look_at(origin=data["eye"], target=(0, 0, 0), up=(0, 0, 1))
    sigma_t = data["sigma_t"]
    film = {"type": "hdrfilm", "width": data["pixels"], "height": data["pixels"], "pixel_format": "rgb"}
    sensor = {"type": "orthographic", "to_world": look @ mi.ScalarTransform4f().scale(0.5 * data["width"])}
    return {
        "type": "scene",
        "integrator": {
            "type": "volpathmis" if max(sigma_t) > min(sigma_t) else "volpath",
            "max_depth": -1,
            "rr_depth": 50,
        },
        "sensor": {**sensor, "film": {**film, "rfilter": {"type": "box"}}},
        "lamp": {"type": "point", "position": data["lamp"], "intensity": {"type": "rgb", "value": [data["power"]] * 3}},
        "body": mesh(
            data["vertices"],
            data["triangles"],
            folder / "body.ply",
            bsdf={"type": "diffuse_boundary"},
            interior=medium(sigma_t, data["alpha"], data["g"]),
        ),
    }


if __name__ == "__main__":
    source = Path(sys.argv[1])
    data = json.loads(source.read_text())
    loaded = mi.load_dict(scene(data, source.parent))
    pictures = [mi.render(loaded, spp=data["samples"], seed=seed) for seed in range(data["seeds"])]
    np.save(sys.argv[2], np.stack([np.array(p)[::-1, :, :3] for p in pictures]))  # rows from the bottom
