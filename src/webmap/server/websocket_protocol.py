"""The WebSocket protocol of the server: uvicorn's, but text may be no UTF-8."""

from uvicorn.protocols.websockets.websockets_sansio_impl import (
    WebSocketsSansIOProtocol,
)


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """Hands a text that is not UTF-8 to the application as bytes.

    uvicorn ends the connection of such a text without telling the application of it,
    and logs a traceback. The application refuses it as it refuses every binary message,
    and can see before that whether it is a STOP (S10).
    """

    def send_receive_event_to_app(self) -> None:
        """Pass on a message that is whole."""
        if self.curr_msg_data_type == "text":
            try:
                b"".join(self.frames).decode()
            except UnicodeDecodeError:
                self.curr_msg_data_type = "bytes"
        super().send_receive_event_to_app()
