// SPDX-License-Identifier: Apache-2.0
// Overlay of the picture: a panel of facts, plots and controls, help, a legend of colours and lines of text. Plain
// data; the presenter draws it and writes the person's changes into it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

struct OverlayItem {
    enum class Kind : uint32_t { Heading, Text, Plot, Toggle, Choice, Slider, Button, Colour };
    Kind kind = Kind::Text;
    std::string label; // unique among the items of a heading
    std::string text;  // value of a Text; of other kinds a hint, such as the key that does the same
    bool enabled = true;

    bool on = false;                      // Toggle; Heading: unfolded
    int choice = 0;                       // Choice: index, -1 = none
    std::vector<std::string> choices;     // Choice
    float value = 0, least = 0, most = 1; // Slider
    float colour[3] = {};                 // Colour: 0 to 1, as displayed
    std::vector<float> history;           // Plot, oldest value first; the last value is printed beside it
    bool changed = false;                 // the person changed it since this was set to false
};

// A line of text over everything else.
struct OverlayNote {
    enum class Align : uint32_t { Left, Middle, Right };
    Align align = Align::Left; // alignment of the text at x
    float x = 0, y = 0;        // share of the window's width and height; at y = 0 the text hangs down, at 1 it stands
    std::string text;
};

// Colours and their meaning, under the notes at the top.
struct OverlayLegend {
    struct Colour {
        float rgb[3];
        std::string text;
    };
    std::string title;
    std::vector<Colour> colours; // empty: nothing is shown
};

struct Overlay {
    bool panel = false, help = false;
    bool takes_keys = false; // the keyboard moves through the panel
    std::vector<OverlayItem> items;
    std::vector<std::pair<std::string, std::string>> keys; // lines of the help: key, its effect
    std::vector<OverlayNote> notes;
    OverlayLegend legend;
    std::string message; // at the bottom
};

} // namespace gsc
