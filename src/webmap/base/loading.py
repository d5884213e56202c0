"""Loading of large packages without blocking the event loop.

The first import of numpy takes 0.1 s of processor time, that of a WebSocket client 30
ms. In another thread the event loop goes on meanwhile.
"""

import asyncio
import importlib
import sys


async def load(module: str) -> None:
    """Import a module in a thread, and wait for it."""
    if module not in sys.modules:
        await asyncio.to_thread(importlib.import_module, module)


def load_soon(module: str) -> None:
    """Begin to import a module in a thread; does nothing without an event loop.

    Code that needs the module imports it all the same, which waits for the thread.
    """
    if module in sys.modules:
        return
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        return
    loop.run_in_executor(None, importlib.import_module, module)
