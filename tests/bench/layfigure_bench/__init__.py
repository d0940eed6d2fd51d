"""Work-precision of Layfigure's steps beside other engines: CPU time against error on the same scenes."""
