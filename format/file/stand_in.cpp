// SPDX-License-Identifier: Apache-2.0
#include "format/file/stand_in.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

// note: bytes; Git LFS takes a file for a pointer only if it is smaller than this
constexpr uint64_t kMaxPointer = 1024;
// bytes of the longest path that is taken for a symbolic link which Git stored as text
constexpr uint64_t kMaxLink = 512;

bool isSpace(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

std::string_view withoutMark(std::string_view text)
{
    if (text.starts_with("\xef\xbb\xbf"))
        text.remove_prefix(3);
    while (!text.empty() && isSpace(text.front()))
        text.remove_prefix(1);
    return text;
}

bool startsWithWord(std::string_view text, std::string_view lower)
{
    return text.size() >= lower.size() && std::equal(lower.begin(), lower.end(), text.begin(), [](char a, char b) {
               return a == (b >= 'A' && b <= 'Z' ? b - 'A' + 'a' : b);
           });
}

// Size that a Git LFS pointer states, as text for a message; "an unknown number of" if it states none.
std::string statedSize(std::string_view pointer)
{
    const size_t at = pointer.find("\nsize ");
    if (at == std::string_view::npos)
        return "an unknown number of";
    const std::string_view rest = pointer.substr(at + 6);
    const size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
    return digits == 0 || digits > 20 ? "an unknown number of" : std::string(rest.substr(0, digits));
}

void refusePointer(std::string_view text, uint64_t bytes, const std::string& path)
{
    // the first address is of every version of Git LFS, the two others of those before 1.0
    const bool known = text.starts_with("version https://git-lfs.github.com/spec/") ||
                       text.starts_with("version https://hawser.github.com/spec/") ||
                       text.starts_with("version http://git-media.io/v/");
    if (known && bytes < kMaxPointer)
        throw Error(ErrorCode::InvalidFile, path, "is a Git LFS pointer",
                    "the file of " + statedSize(text) + " bytes that it stands for",
                    "fetch it with 'git lfs pull' in its clone, or download the file itself");
}

void refusePage(std::string_view text, const std::string& path)
{
    const char* kind = nullptr;
    for (const char* start : {"<!doctype html", "<html", "<head", "<body", "<!--", "<title", "<meta", "<script"})
        if (startsWithWord(text, start))
            kind = "a web page";
    for (const char* start : {"<?xml", "<error>"}) // beginnings of the error pages of storage services
        if (startsWithWord(text, start))
            kind = "an XML document";
    if (kind)
        throw Error(ErrorCode::InvalidFile, path, std::string("is ") + kind, "the file that it is named as",
                    "download the file itself, a server may have sent this instead");
}

// Returns true if `text` holds the word `lower`, which is in lower case, in letters of any case.
bool holdsWord(std::string_view text, std::string_view lower)
{
    for (; text.size() >= lower.size(); text.remove_prefix(1))
        if (startsWithWord(text, lower))
            return true;
    return false;
}

// Returns true if `text` is one line of those that GitHub, Hugging Face or a storage service sends in place of a file.
bool isAnswer(std::string_view text)
{
    for (const std::string_view line :
         {"404: not found", "404 not found", "not found", "page not found", "file not found", "entry not found",
          "repository not found", "403 forbidden", "403: forbidden", "forbidden", "access denied", "unauthorized",
          "invalid username or password"})
        if (startsWithWord(text, line) && text.substr(line.size()).find_first_not_of(".! \t\r\n") == text.npos)
            return true;
    return false;
}

// Returns true if `text` is such an error answer in the form of a JSON object.
bool isAnswerObject(std::string_view text)
{
    if (!text.starts_with('{'))
        return false;
    text = withoutMark(text.substr(1));
    if (!text.starts_with("\"message\"") && !text.starts_with("\"error\""))
        return false;
    for (const char* word : {"not found", "documentation_url", "restricted", "denied", "unauthorized", "forbidden"})
        if (holdsWord(text, word))
            return true;
    return false;
}

void refuseAnswer(std::string_view text, uint64_t bytes, const std::string& path)
{
    if (bytes >= kMaxPointer || (!isAnswer(text) && !isAnswerObject(text)))
        return;
    std::string shown(text.substr(0, std::min<size_t>(text.find_first_of("\r\n"), 80)));
    std::ranges::replace_if(
        shown, [](char c) { return c >= 0 && (c < 0x20 || c == 0x7f); }, ' ');
    throw Error(ErrorCode::InvalidFile, path, "is an answer of a server, '" + shown + "'",
                "the file that it is named as", "check the address, and download the file again");
}

std::string_view extensionOf(std::string_view path)
{
    const std::string_view name = path.substr(path.find_last_of('/') + 1);
    const size_t dot = name.find_last_of('.');
    return dot == std::string_view::npos ? name : name.substr(dot);
}

// Throws if the file is one line of path characters that ends with the file's own name: a symbolic link that Git stored
// as text.
void refuseLink(std::string_view text, uint64_t bytes, const std::string& path)
{
    if (bytes > kMaxLink || bytes == 0 || text.size() != bytes)
        return;
    while (!text.empty() && isSpace(text.back()))
        text.remove_suffix(1);
    const bool letters = std::all_of(text.begin(), text.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || (c & 0x80) != 0 ||
               std::string_view("/._-+ ").find(c) != std::string_view::npos;
    });
    if (letters && !text.empty() && text.find('/') != std::string_view::npos && extensionOf(text) == extensionOf(path))
        throw Error(ErrorCode::InvalidFile, path,
                    "holds nothing but the path '" + std::string(text.substr(0, 120)) + "'", "the file that it names",
                    "it is a symbolic link that Git left as text, pass the file itself");
}

struct Packing {
    std::string_view magic;
    const char* name;
    const char* tool;
};

constexpr Packing kPackings[] = {{"\x1f\x8b\x08", "gzip", "gunzip"},      {"\x28\xb5\x2f\xfd", "zstd", "zstd -d"},
                                 {{"\xfd\x37zXZ\0", 6}, "xz", "unxz"},    {"BZh", "bzip2", "bunzip2"},
                                 {"7z\xbc\xaf\x27\x1c", "7-Zip", "7z x"}, {"Rar!\x1a\x07", "RAR", "unrar x"}};

void refusePacked(std::string_view start, const std::string& path)
{
    for (const Packing& packing : kPackings) {
        if (!start.starts_with(packing.magic) || start.size() < 10)
            continue;
        // tells gzip from a COLMAP file of 559,903 cameras, which has the same first bytes and then the number of a
        // camera
        if (packing.magic.size() == 3 && packing.name[0] == 'g' && start[8] != 0 && start[8] != 2 && start[8] != 4)
            continue;
        // bzip2: a digit from 1 to 9 follows, and then this magic number
        if (packing.name[0] == 'b' && start.substr(4, 6) != "1AY&SY")
            continue;
        throw Error(ErrorCode::Unsupported, path, std::string("is compressed with ") + packing.name, "the file itself",
                    std::string("unpack it with ") + packing.tool);
    }
}

} // namespace

void refuseStandIn(std::span<const std::byte> start, uint64_t bytes, const std::string& path)
{
    const std::string_view raw(reinterpret_cast<const char*>(start.data()), std::min(start.size(), kStandInBytes));
    const std::string_view text = withoutMark(raw);
    refusePointer(text, bytes, path);
    refusePage(text, path);
    refuseAnswer(text, bytes, path);
    refuseLink(raw, bytes, path);
    refusePacked(raw, path);
}

void refuseStandIn(std::string_view whole, const std::string& path)
{
    refuseStandIn(std::as_bytes(std::span(whole)), whole.size(), path);
}

} // namespace gsc
