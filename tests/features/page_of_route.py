"""A page with the tool for routes, and nobody to go along them."""

import webmap


@webmap.page("/")
def open_page(page: webmap.Page) -> None:
    """Show 24 m by 16 m of nothing."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("RouteTool")
    # Who hears Escape, too.
    map.add_module("StopButton")
    map.fit(0, 0, 24, 16)
