#pragma once
#include <map>
#include <string>
#include <vector>

#include "phs/scalars/scalar.h"

/// Order conditions of compositions by direct computation. Flows of generic vector fields multiply
/// like exponentials in the free associative algebra over their letters; a power series in h is cut
/// where the weight of its words exceeds the order. No condition can be missed, as the words are
/// independent.
namespace porthos::test {

using phs::Quad;

/// A series: the coefficient of every word up to a weight. A word is a string of letters, each of
/// which says its weight.
class WordSeries {
 public:
  using Letters = std::map<char, int>;  ///< letter and its weight: the power of h it carries
  WordSeries(Letters letters, int heaviest) : letters_(std::move(letters)) {
    add_words("", 0, heaviest);
    c_[""] = 1;
  }

  /// Multiplies from the right by exp(Σ coefficient[a] a).
  void times_exp(const std::map<char, Quad>& coefficient) {
    std::map<std::string, Quad> product;
    for (const auto& [word, unused] : c_) {
      Quad sum = 0, tail = 1;  // of the last k letters: Π coefficients / k!
      for (size_t k = 0;; ++k) {
        sum += c_.at(word.substr(0, word.size() - k)) * tail;
        if (k == word.size()) break;
        const auto a = coefficient.find(word[word.size() - 1 - k]);
        if (a == coefficient.end()) break;
        tail *= a->second / Quad(double(k + 1));
      }
      product[word] = sum;
    }
    c_ = std::move(product);
  }

  /// Largest coefficient of the difference from exp(Σ of the letters of weight 1), over the words
  /// of that weight.
  Quad defect(int weight) const {
    Quad worst = 0;
    for (const auto& [word, c] : c_) {
      if (weight_of(word) != weight) continue;
      Quad exact = int(word.size()) == weight ? 1 : 0;
      for (size_t k = 1; k <= word.size(); ++k) exact /= Quad(double(k));
      worst = phs::max(worst, phs::abs(c - exact));
    }
    return worst;
  }
  /// Largest defect of the weights 1 … order.
  Quad defect_up_to(int order) const {
    Quad worst = 0;
    for (int w = 1; w <= order; ++w) worst = phs::max(worst, defect(w));
    return worst;
  }

 private:
  void add_words(const std::string& word, int weight, int heaviest) {
    c_[word] = 0;
    for (const auto& [letter, w] : letters_)
      if (weight + w <= heaviest) add_words(word + letter, weight + w, heaviest);
  }
  int weight_of(const std::string& word) const {
    int w = 0;
    for (char a : word) w += letters_.at(a);
    return w;
  }

  Letters letters_;
  std::map<std::string, Quad> c_;
};

/// Ψ(γ_1 h) … Ψ(γ_s h) of a generic symmetric Ψ(h) = exp(h Y1 + h³ Y3 + h⁵ Y5 + …), up to
/// h^heaviest.
inline WordSeries symmetric_composition(const std::vector<Quad>& gamma, int heaviest) {
  WordSeries::Letters letters;
  for (int k = 1; k <= heaviest; k += 2) letters[char('0' + k)] = k;
  WordSeries product(letters, heaviest);
  for (const Quad g : gamma) {
    std::map<char, Quad> powers;
    Quad power = g;
    for (const auto& [letter, weight] : letters) {
      powers[letter] = power;
      power *= g * g;
    }
    product.times_exp(powers);
  }
  return product;
}

/// The flows of `parts` generic vector fields in the order given, up to h^heaviest: (part,
/// coefficient).
inline WordSeries splitting(const std::vector<std::pair<int, Quad>>& flows, int parts,
                            int heaviest) {
  WordSeries::Letters letters;
  for (int k = 0; k < parts; ++k) letters[char('A' + k)] = 1;
  WordSeries product(letters, heaviest);
  for (const auto& [part, c] : flows) product.times_exp({{char('A' + part), c}});
  return product;
}

}  // namespace porthos::test
