"""A limit on the size of files stands in for a disk that fills."""

import resource
import signal


def disk_of(most_bytes):
    """preexec_fn of a program each of whose files is limited to this size."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    return limit
