// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/peers/peers.h"

namespace tetwarp::bench {

std::optional<std::string> vtk_version() { return {}; }
Peer make_vtk_probe(const PeerInput&, const VertexField&) { return {}; }

}  // namespace tetwarp::bench
