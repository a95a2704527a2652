"""Jobs of several processes, as `mpiexec` starts them: also as root, and more than there are cores."""

import os
import subprocess
import sys
from pathlib import Path

SUPPORT = Path(__file__).parent
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "PYTHONPATH": os.pathsep.join(map(str, (SUPPORT.parents[1], SUPPORT))),
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_hwloc_default_binding_policy": "none",
}


def mpiexec(ranks, script, *arguments, cwd, **environment):
    """Return what a script of this folder ends with, in a folder, on some processes."""
    command = [
        Path(sys.executable).with_name("mpiexec"),
        "-n",
        ranks,
        sys.executable,
        "-P",
        SUPPORT / script,
        *arguments,
    ]
    return subprocess.run(
        list(map(str, command)),
        cwd=cwd,
        env=os.environ | ENVIRONMENT | environment,
        capture_output=True,
        text=True,
        timeout=600,
    )
