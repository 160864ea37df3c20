"""Messages from rigs to the drums: links, strikes, streamed contacts, discovery."""
