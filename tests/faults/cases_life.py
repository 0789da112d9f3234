"""Signals under load: orderly shutdown, kill, reload of the configuration (loops: signals.py)."""
import signals
from support import case


@case("SIGTERM under load", 20, 2)
def terminate(world, count):
    return signals.terminate(world.program, world.new_folder(), count, world.slack)


@case("SIGKILL under load, then a restart", 20, 2)
def kill(world, count):
    return signals.kill(world.program, world.new_folder(), count, world.slack)


@case("SIGHUP with an invalid configuration", 39, 13)
def hang_up(world, count):
    return signals.hang_up(world.program, world.new_folder(), count, world.slack)
