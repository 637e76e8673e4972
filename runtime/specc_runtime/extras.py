"""What a run needs beside the compiler, and the extra of the package `specc` that brings it."""

_EXTRAS = {
    "numpy": "run",
    "mujoco": "run",
    "pinocchio": "run",
    "rich": "run",
    "cv2": "vision",
    "mcap": "record",
    "orjson": "record",
    "lz4": "record",
    "zstandard": "record",
}


def remedy(error: ModuleNotFoundError) -> str:
    """What is not installed and how to install it."""
    package = (error.name or "").partition(".")[0]
    if package not in _EXTRAS:
        return (
            f"there is no module {error.name}; "
            "install it, put it beside the specification, or add its folder to PYTHONPATH"
        )
    return f"{package} is not installed: `pip install 'specc[{_EXTRAS[package]}]'` brings it"
