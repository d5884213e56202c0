"""The console shows a refused command."""

import pytest
from playwright.sync_api import expect

pytestmark = pytest.mark.browser

SEND = """async ([path, texts]) => {
  const { protocols } = await import("/_webmap/web/access.js");
  const url = new URL(path, location.href.replace(/^http/, "ws"));
  const socket = new WebSocket(url, protocols());
  return await new Promise((resolve) => {
    socket.onopen = () => {
      for (const text of texts) socket.send(text ?? new Uint8Array(3));
      socket.close();
    };
    socket.onclose = ({ code }) => resolve(code);
  });
}"""


def test_refused_messages_are_counted_and_shown_with_the_last_reason(open_console):
    page = open_console()
    refused = page.locator("#refused")
    expect(refused.locator("summary")).to_be_hidden()
    page.evaluate(SEND, ["_webmap/drive", ['{"op":"drive","v":NaN}'] * 9])
    expect(refused.locator("summary > span").first).to_have_text("9 refused")
    expect(refused.locator("summary .newest")).to_contain_text("NaN")
    refused.locator("summary").click()
    line = refused.locator("li")
    expect(line).to_have_count(1)
    expect(line).to_contain_text("9 messages, the last at")
    expect(line.locator(".refused-last")).to_contain_text("NaN")
    page.evaluate(SEND, ["_webmap/drive", [None]])
    expect(refused.locator("summary > span").first).to_have_text("10 refused")
    expect(line.locator(".refused-last")).to_contain_text("a binary message")
