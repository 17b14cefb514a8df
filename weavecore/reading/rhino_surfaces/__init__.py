"""Any surface of a Rhino file as one welded triangle mesh, without Rhino."""
