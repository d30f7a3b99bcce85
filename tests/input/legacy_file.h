// SPDX-License-Identifier: Apache-2.0
// Files as torch.save wrote them before PyTorch 1.6, made from their parts.
#pragma once

#include <cstdint>
#include <string>

namespace gsc::test {

inline const std::string kProto = "\x80\x02";
inline const std::string kMagicPickle = kProto + "\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.";

// Strings as Python 2 writes them.
inline std::string shortText(const std::string& text)
{
    return std::string("U") + char(text.size()) + text;
}

inline std::string little64(uint64_t value)
{
    return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

struct OldFile {
    std::string magic = kMagicPickle;
    std::string protocol = kProto + "M\xe9\x03.";
    std::string machine =
        kProto + "}(" + shortText("little_endian") + "\x88" + shortText("protocol_version") + "M\xe9\x03u.";
    std::string object;
    std::string keys = kProto + "](" + shortText("70") + "e.";
    std::string storages = little64(3) + std::string("\0\0\x80\x3f\0\0\0\x40\0\0\x40\x40", 12); // 1, 2, 3

    [[nodiscard]] std::string text() const { return magic + protocol + machine + object + keys + storages; }
};

// _rebuild_tensor(storage '70' of three floats, 0, (3,), (1,)) as PyTorch 0.1 to 0.3 wrote it; `view` is the storage's.
inline std::string oldTensor(const std::string& view = "N", const std::string& type = "FloatStorage")
{
    return "ctorch._utils\n_rebuild_tensor\n((" + shortText("storage") + "ctorch\n" + type + "\n" + shortText("70") +
           shortText("cpu") + "K\x03" + view + std::string("tQK\0(K\x03t(K\x01ttR", 14);
}

// An OrderedDict of Python 2: made of a list of lists.
inline std::string oldDict(const std::string& key, const std::string& value)
{
    return kProto + "ccollections\nOrderedDict\n(](](" + shortText(key) + value + "eetR.";
}

} // namespace gsc::test
