"""The web application: pages, files, sign-in, the two sockets, and what runs it.

Nothing here is imported by ``import webmap``: the web stack is loaded when a program
starts to serve.
"""
