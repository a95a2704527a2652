"""The command line without figures, in a process of an MPI job: `mpiexec -n 2 python mpi_command.py solve poisson ..`.

IGA_NN_FAIL says what the second process does in the middle of the solve: "die", or "raise" an error of its own.
"""

import os
import signal

import solve.system as system
from iga_nn.__main__ import run_and_exit
from iga_nn.report import viewer
from iga_nn.workflow import mpi_job
from iga_nn.workflow.output_folder import RunFolder
from parameterize.conjugate_gradients import conjugate_gradients

RunFolder.draw = lambda *_, **__: None
viewer.scene_of = lambda *_, **__: None
mpi_job.GRACE = 1.0


def failing(*arguments):
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 1:
        if os.environ["IGA_NN_FAIL"] == "raise":
            raise RuntimeError("no more of this")
        os.kill(os.getpid(), signal.SIGKILL)
    return conjugate_gradients(*arguments)


if "IGA_NN_FAIL" in os.environ:
    system.conjugate_gradients = failing
run_and_exit()
