"""Windows: what lies around points of a surface finds parts, and geodesic distances verify them.

=================  ============================================================================
`moments`          seven numbers of what lies within a radius of a point
`signature`        windows of a shape around farthest points, and how far these are apart
`rows`             a stored signature as bytes
`whitening`        differences in units of what two copies of a shape differ by
`comparing`        X: how far the query's windows are from their nearest ones
`verification`     p: whether these lie as they do on the query
`trust`            how much all this counts for a query, beside the bank's distance
`evidence`         all of it for the candidates of a query
=================  ============================================================================
"""
