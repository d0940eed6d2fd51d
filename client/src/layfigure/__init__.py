"""Client of the Layfigure server: record, play, check and draw the takes of an elasto-plastic doll."""

__version__ = "0.1.0"
