"""Programs that must succeed."""

import subprocess


def run(*command, timeout=1200, **options):
    """What it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout
