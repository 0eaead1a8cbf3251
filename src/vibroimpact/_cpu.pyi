def supported() -> list[str]:
    """Instruction sets of this processor that the kernel is built for, best first."""
