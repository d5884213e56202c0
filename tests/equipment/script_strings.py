"""Texts that run a script if a page takes one of them for markup or code."""

_RUN = "window.__pwned=1"

SCRIPTS = (
    f"<script>{_RUN}</script>",
    f"<ScRiPt >{_RUN}</sCrIpT>",
    f"<<script>{_RUN};//<</script>",
    f"<scr<script>ipt>{_RUN}</scr</script>ipt>",
    f"<script\x0c>{_RUN}</script>",
    f'<script src="data:text/javascript,{_RUN}"></script>',
    f"<img src=x onerror={_RUN}>",
    f"<img/src=x/onerror={_RUN}>",
    f"<IMG SRC=x ONERROR={_RUN}//",
    f"<img src='x'onerror='{_RUN}'>",
    f'"><img src=x onerror={_RUN}>',
    f"'><img src=x onerror={_RUN}>",
    f"--><img src=x onerror={_RUN}><!--",
    f"]]><img src=x onerror={_RUN}>",
    f"</title><img src=x onerror={_RUN}>",
    f"</textarea><img src=x onerror={_RUN}>",
    f"</style><img src=x onerror={_RUN}><style>",
    f"</script><img src=x onerror={_RUN}><script>",
    f"</svg><img src=x onerror={_RUN}>",
    f"</text><script>{_RUN}</script>",
    f"<svg onload={_RUN}>",
    f"<svg><script>{_RUN}</script></svg>",
    f"<svg><animate onbegin={_RUN} attributeName=x dur=1s>",
    f'<svg><a xlink:href="javascript:{_RUN}"><rect width=99 height=99></a></svg>',
    f"<svg><foreignObject><iframe onload={_RUN}></iframe></foreignObject></svg>",
    f"<body onload={_RUN}>",
    f"<iframe srcdoc='<script>parent.{_RUN[7:]}</script>'></iframe>",
    f"<iframe src=javascript:parent.{_RUN[7:]}></iframe>",
    f"<object data=javascript:{_RUN}>",
    f"<embed src=javascript:{_RUN}>",
    f"<a href=javascript:{_RUN} autofocus onfocus={_RUN}>x</a>",
    f"<input autofocus onfocus={_RUN}>",
    f"<details open ontoggle={_RUN}>",
    f"<video><source onerror={_RUN}></video>",
    f"<marquee onstart={_RUN}>",
    f"<base href=//example.com/><link rel=stylesheet href=x onload={_RUN}>",
    f"<math><mtext><table><mglyph><style><img src=x onerror={_RUN}>",
    f"<template><img src=x onerror={_RUN}></template>",
    f"javascript:{_RUN}",
    f'" onmouseover="{_RUN}" x="',
    f"' onfocus='{_RUN}' autofocus='",
    f"&lt;img src=x onerror={_RUN}&gt;",
    f"\\u003cimg src=x onerror={_RUN}\\u003e",
    f"${{{_RUN}}}{{{{constructor.constructor('{_RUN}')()}}}}",
    f"url(javascript:{_RUN}); background: expression({_RUN})",
    f"__proto__\u2028{_RUN}//",
)

WATCH = """(() => {
  window.__violations = [];
  window.__seen = new Set();
  addEventListener("securitypolicyviolation", (event) => {
    __violations.push(`${event.violatedDirective} ${event.blockedURI} ${event.sample}`);
  });
  const note = (text) => {
    if (text?.includes("__pwned")) __seen.add(text.slice(0, 2000));
  };
  const look = (node) => {
    if (node.nodeType === Node.TEXT_NODE) note(node.data);
    for (const { value } of node.attributes ?? []) note(value);
    for (const child of node.childNodes) look(child);
  };
  new MutationObserver((records) => {
    for (const { type, target, attributeName, addedNodes } of records)
      if (type === "attributes") note(target.getAttribute(attributeName));
      else if (type === "characterData") note(target.data);
      else addedNodes.forEach(look);
  }).observe(document, {
    subtree: true, childList: true, characterData: true, attributes: true,
  });
})()"""
"""To run before every page: keeps its texts with scripts, and counts what the page's
policy has blocked."""

FOUND = """() => ({
  pwned: window.__pwned,
  violations: window.__violations,
  markup: [...document.querySelectorAll("*")].filter((each) =>
    /^(iframe|object|embed|base|marquee|math|video|foreignobject)$/i.test(each.tagName)
    || (each.localName === "script" && !each.src)
    || /^\\s*javascript:/i.test(each.getAttribute("href") ?? "")
    || [...each.attributes].some(({ name }) => name.startsWith("on"))
  ).map((each) => each.outerHTML.slice(0, 200)),
})"""
"""What a text has become on a page, if it was more than a text."""

NOTHING = {"pwned": None, "violations": [], "markup": []}
