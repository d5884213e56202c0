"""A page with the tool for routes, without robots."""

import webmap


@webmap.page("/")
def open_page(page: webmap.Page) -> None:
    """Show an empty map of 24 m by 16 m."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("RouteTool")
    # This tool handles Escape, too.
    map.add_module("StopButton")
    map.fit(0, 0, 24, 16)
