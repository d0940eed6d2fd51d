"""A server process and a client that speaks to it with LCM alone, without the layfigure package."""
