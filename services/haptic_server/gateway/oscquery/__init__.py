"""OSCQuery: the tree of OSC addresses over HTTP, and what is sent to them over WebSocket. Off unless asked for."""
