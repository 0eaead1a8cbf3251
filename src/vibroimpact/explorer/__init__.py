"""The explorer: machines as a page in the browser has them, and the command's server.

What belongs here is what the page needs of Python: recordings of the compile step, descriptions of machines, the
page with both put in. The page itself, TypeScript and the kernel for WebAssembly, is in ``web/``.
"""
