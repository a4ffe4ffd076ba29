"""What becomes of a path that sees a shadow catcher; what is made of it, and why: docs/shadow-catchers.md."""

from ...kernels.core.jit import device, inlined
from ...kernels.core.records import INSTANCE_HOLDOUT, INSTANCE_SHADOW_CATCHER, instance_at
from ...kernels.core.records.scratch import go_over
from ...kernels.core.vec import vec
from ...kernels.film.contribute import add_world_behind, catch, is_wanted, wants_world_behind
from ...kernels.lights.world import world_radiance
from ...kernels.path.state import ENDS, LIT, SHADES, pass_through


@inlined
def meet_catcher(scene, film, scratch, path, sp):
    """Let the path be caught where it is the first to see a shadow catcher at sp."""
    if path.background_visible > 0 and path.caught == 0:
        flags = instance_at(scene.instances, sp.instance).flags
        if flags & (INSTANCE_SHADOW_CATCHER | INSTANCE_HOLDOUT) == INSTANCE_SHADOW_CATCHER:
            _meet(scene, film, scratch, path, sp)


@device
def _meet(scene, film, scratch, path, sp):
    """Let the path go on as one of the catcher, in the scene that is meant for it."""
    catch(film, path)
    if wants_world_behind(film):
        add_world_behind(film, path, world_radiance(scene, scratch, sp, vec(path.o), vec(path.d)))
    if scene.caught != 0:
        go_over(scene, scene.caught)


@inlined
def light_or_leave(integrator, film, path, sp):
    """The next event of a path whose surface at sp has been shaded."""
    if not is_wanted(film, path):
        return _look_for_catchers(integrator, film, path, sp)
    return pass_through(integrator, path, sp, vec(sp.transparent)) if path.last else SHADES


@device
def _look_for_catchers(integrator, film, path, sp):
    """`light_or_leave` where the film does not take what the path finds.

    One that may still be caught goes straight on through what is transparent; others end.
    """
    if path.caught != 0 or path.background_visible == 0:
        return ENDS
    if path.last or integrator.seen_through < 0.0:
        return pass_through(integrator, path, sp, vec(sp.transparent))
    return LIT
