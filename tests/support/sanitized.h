// SPDX-License-Identifier: Apache-2.0
// A sanitizer makes a loop over random cases some forty times as long; half of them finds what it is to find.
#pragma once

namespace gsc::test {

constexpr bool isSanitized()
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return true;
#else
    return false;
#endif
}

constexpr int casesOf(int n)
{
    return isSanitized() ? (n + 1) / 2 : n;
}

} // namespace gsc::test
