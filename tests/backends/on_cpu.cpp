// SPDX-License-Identifier: Apache-2.0
#include "tests/backends/backend.h"

const gsc::test::Backend gsc::test::kBackend = {.name = "cpu",
                                                .judge = "cpu-reference",
                                                .tiers = {Tier::Fast},
                                                .policies = {ReusePolicy::Error, ReusePolicy::Depth},
                                                .exact_db = 85,
                                                .kept_db = 70,
                                                .other_depths = 2e-3,
                                                .table_bytes = 256u << 10,
                                                .makes_all = true,
                                                .frames = 5};
