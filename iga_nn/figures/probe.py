"""Tries whether VTK draws here. Without a graphics library it may crash: run this in a process that may end so."""

import os
import sys


def choose_window() -> None:
    """Let VTK take EGL where there is no X server, without trying X and warning; before VTK is imported."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def draws() -> bool:
    """Return whether a picture of a red ball has more than one colour."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[16, 16])
    plotter.add_mesh(pyvista.Sphere(), color="red")
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return bool(image.std() > 1.0)


if __name__ == "__main__":
    raise SystemExit(0 if draws() else 1)
