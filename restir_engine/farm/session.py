"""placeholder"""


def add_commands(c):
    pass


def run_command(o):
    return 2
