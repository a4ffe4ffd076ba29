"""Media inside closed meshes: scattering, absorption and emission, behind glass and with invisible boundaries."""

from .. import kit
from ..registry import scene

JADE = (0.35, 0.75, 0.45)


def medium(build, **keywords):
    """A material with nothing but a volume."""
    return kit.material(lambda node: {"Volume": build(node)}, **keywords)


def scattering(color=(0.8, 0.5, 0.3), density=2.0, **inputs):
    """A material of one Volume Scatter node."""
    return medium(lambda node: node("VolumeScatter", Color=color, Density=density, **inputs))


def glass(build, **inputs):
    """A glass boundary with a volume inside."""
    return kit.material(lambda node: {"Surface": node("BsdfGlass", **inputs), "Volume": build(node)})


def stage():
    """The floor and lights of these scenes."""
    kit.floor(kit.diffuse((0.6, 0.55, 0.5)))
    kit.lamp(400.0)
    kit.world(lambda node: node("Background", Color=(0.7, 0.85, 1.0), Strength=0.3))


@scene(1, 64, volume_bounces=8, alike=True)
def volume_scatter():
    stage()
    kit.put("cube", scattering(), (-1.0, 0.0, 0.7), 0.6)
    kit.put("ball", scattering(JADE, 5.0, Anisotropy=0.6), (0.9, 0.0, 0.8), 0.7)


@scene(1, 96, volume_bounces=8, alike=True)
def volume_lamp_inside():
    """Paths are led towards the lamp, whose Multiple Importance is off: with it Cycles loses light inside of media."""
    kit.floor(kit.diffuse((0.6, 0.55, 0.5)))
    kit.put("cube", scattering((0.8, 0.8, 0.6), 1.0), (0.0, 0.0, 1.0), 0.95)
    lamp = kit.light("POINT", 60.0, (0.2, 0.1, 1.1), shadow_soft_size=0.15)
    lamp.data.cycles.use_multiple_importance_sampling = False
    kit.world(lambda node: node("Background", Color=(0.7, 0.85, 1.0), Strength=0.1))


@scene(1, 64)
def volume_single_scatter():
    stage()
    kit.put("monkey", scattering(JADE, 3.0), (0.0, 0.0, 1.0), 1.0, rotation=(0.0, 0.0, 20.0))


@scene(1, 96, volume_bounces=4)
def volume_phases():
    stage()
    kinds = ("RAYLEIGH", "DRAINE", "FOURNIER_FORAND", "MIE")
    things = kit.row([scattering((0.9, 0.8, 0.7), 2.0, phase=kind) for kind in kinds], "cube", 3.6, 0.45)
    for thing in things:
        thing.location.z += 0.1


@scene(1, 96, alike=True)
def volume_absorption_in_glass():
    def inside(node):
        return node("VolumeAbsorption", Color=(0.2, 0.6, 0.9), Density=1.5)

    stage()
    clear = kit.material(lambda node: {"Surface": node("BsdfTransparent"), "Volume": inside(node)})
    kit.put("ball", glass(inside, Roughness=0.0, IOR=1.45), (-0.9, 0.0, 0.8), 0.7)
    kit.put("cube", clear, (0.9, 0.0, 0.7), 0.6, rotation=(0.0, 0.0, 30.0))


@scene(2, 256, volume_bounces=8)
def volume_in_rough_glass():
    def inside(node):
        return node("VolumeScatter", Color=(0.9, 0.6, 0.3), Density=3.0)

    kit.floor()
    kit.world(lambda node: node("Background", Color=(0.7, 0.85, 1.0), Strength=1.0))
    kit.put("ball", glass(inside, Roughness=0.3, IOR=1.45), (-0.9, 0.0, 0.8), 0.7)
    kit.put("ball", glass(inside, Roughness=0.0, IOR=1.45), (0.9, 0.0, 0.8), 0.7)


@scene(1, 64, volume_bounces=4)
def volume_principled():
    def smoke(node):
        return node(
            "VolumePrincipled", Color=(0.6, 0.4, 0.3), Density=3.0, inputs={"Absorption Color": (0.1, 0.3, 0.6)}
        )

    def fire(node):
        inputs = {"Blackbody Intensity": 1.0, "Emission Strength": 0.2, "Emission Color": (0.2, 0.4, 1.0)}
        return node("VolumePrincipled", inputs, Density=1.0, Temperature=1500.0, Anisotropy=0.4)

    stage()
    kit.put("ball", medium(smoke), (-0.9, 0.0, 0.8), 0.7)
    kit.put("ball", medium(fire), (0.9, 0.0, 0.8), 0.7)


@scene(1, 64, volume_bounces=4)
def volume_overlapping():
    stage()
    absorbing = medium(lambda node: node("VolumeAbsorption", Color=(0.9, 0.3, 0.3), Density=2.0))
    kit.put("ball", scattering((0.8, 0.8, 0.8), 1.5), (-0.4, 0.0, 0.9), 0.8)
    kit.put("ball", scattering((0.2, 0.5, 0.9), 3.0, Anisotropy=-0.5), (0.4, 0.0, 0.9), 0.8)
    kit.put("cube", absorbing, (0.0, 0.0, 0.5), 0.45)


@scene(2, 128, volume_bounces=4)
def volume_mixed():
    """Mix and Add Shader, emission, and a light, a diffuse ball and glass inside of a medium."""

    def inside(node):
        first = node("VolumeScatter", Color=(0.9, 0.3, 0.2), Density=1.0, Anisotropy=0.7)
        second = node("VolumeScatter", Color=(0.9, 0.9, 0.9), Density=1.0, Anisotropy=-0.3)
        mixed = node("MixShader", {1: first, 2: second}, Fac=0.4)
        return node("AddShader", {0: mixed, 1: node("Emission", Color=(0.1, 0.3, 0.1), Strength=0.1)})

    stage()
    kit.put("cube", medium(inside), (0.0, 0.0, 1.0), (2.2, 1.0, 0.9))
    kit.put("ball", kit.diffuse((0.8, 0.6, 0.2)), (-1.0, 0.0, 0.6), 0.45)
    kit.put("ball", kit.material(lambda node: node("BsdfGlass", Roughness=0.0)), (0.9, 0.0, 0.6), 0.45)
    kit.light("POINT", 20.0, (0.0, -0.3, 1.3), shadow_soft_size=0.4)


@scene(1, 256, volume_bounces=2, alike=True, deep=True)
def volume_around_camera():
    stage()
    kit.put("cube", scattering((0.8, 0.8, 0.8), 0.08), (0.0, 0.0, 4.0), 9.0)
    kit.put("ball", kit.diffuse((0.8, 0.3, 0.2)), (0.0, 0.0, 0.8), 0.8)


@scene(1, 64, volume_bounces=4)
def volume_coefficients():
    def inside(node):
        inputs = {
            "Absorption Coefficients": (0.5, 0.2, 0.1),
            "Scatter Coefficients": (1.0, 2.0, 3.0),
            "Emission Coefficients": (0.02, 0.0, 0.01),
            "Anisotropy": 0.3,
        }
        return node("VolumeCoefficients", inputs)

    stage()
    kit.put("ball", medium(inside), (0.0, 0.0, 1.0), 0.9)
